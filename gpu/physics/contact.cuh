/// \file
/// Distance to a container's solid and the push out of it, in fp32, written apart from the oracle's.
#pragma once

#include "gpu/core/teams.cuh"
#include "gpu/physics/pose.cuh"

namespace decant::gpu {
namespace {

/// All containers' shapes in device memory. The first few come along with a launch, where they are at hand.
struct DeviceGeometry {
  static constexpr int near_shapes = 2, near_edges = 16;
  int containers;
  const Shape* shapes;
  const Edge* edges;
  const Box* boxes;
  const Face* faces;
  Shape first_shapes[near_shapes];
  Edge first_edges[near_edges];

  DECANT_DEVICE Shape shape(int k) const { return k < near_shapes ? first_shapes[k] : shapes[k]; }
  DECANT_DEVICE Edge edge(int k) const { return k < near_edges ? first_edges[k] : edges[k]; }
};

/// Signed distance (m, positive outside) and its gradient, container frame.
struct Clearance {
  float distance;
  Float3 normal;
};

DECANT_DEVICE float clamp01(float s) { return fminf(fmaxf(s, 0.0f), 1.0f); }

/// From the nearest point of an edge, which is at s of its length, to (r, z).
struct FromEdge {
  float pr, pz, s, r, z;
  DECANT_DEVICE FromEdge(const Edge& e, float to_r, float to_z)
      : pr(to_r - e.r0),
        pz(to_z - e.z0),
        s(clamp01((pr * e.dr + pz * e.dz) * e.inverse_length2)),
        r(pr - s * e.dr),
        z(pz - s * e.dz) {}
  DECANT_DEVICE float squared() const { return r * r + z * z; }
};

/// By all threads of a team, which have the same x.
template <class Team>
DECANT_DEVICE Clearance revolved_clearance(const Team& team, const DeviceGeometry& g, const Shape& shape, Float3 x) {
  const Radius axis = radius(x.x * x.x + x.y * x.y);
  const float r = axis.r, z = x.z;
  float best = 3.0e38f;
  int nearest = 0, crossings = 0;
  // Nothing in it waits for the edge before: a few particles at walls are what a kernel ends with.
#pragma unroll 4
  for (int k = team.lane(); k < shape.edges; k += Team::lanes) {
    const Edge e = g.edge(shape.first_edge + k);
    const FromEdge from(e, r, z);
    const float squared = from.squared();
    nearest = squared < best ? k : nearest;
    best = lesser(squared, best);
    // Even–odd count of the outline beyond r at this height.
    crossings += (e.z0 > z) != (e.z1 > z) && from.pr < from.pz * e.slope;
  }
  team.find_least(best, nearest);
  const bool inside = team.sum(crossings) % 2 != 0;
  const Edge e = g.edge(shape.first_edge + nearest);
  const FromEdge from(e, r, z);
  const float away_r = from.r, away_z = from.z;
  const float face_r = e.dz, face_z = -e.dr;  // the solid is on the left, so outward is right
  const bool at_corner = !(from.s > 0.0f && from.s < 1.0f);
  const Radius away = radius(from.squared());
  const float d = away.r, sign = inside ? -1.0f : 1.0f;
  float nr, nz;
  // Beside an edge its own normal is exact, where a difference of near points is not.
  if (at_corner && d > 1e-6f * (r + fabsf(z))) {
    nr = sign * away_r * away.inverse;
    nz = sign * away_z * away.inverse;
  } else {
    const float inverse = radius(face_r * face_r + face_z * face_z).inverse;
    nr = face_r * inverse;
    nz = face_z * inverse;
  }
  const float cosine = r > 0.0f ? x.x * axis.inverse : 1.0f;
  const float sine = r > 0.0f ? x.y * axis.inverse : 0.0f;
  return {sign * d, {nr * cosine, nr * sine, nz}};
}

template <class Team>
DECANT_DEVICE Clearance box_clearance(const Team& team, const DeviceGeometry& g, const Shape& shape, Float3 x) {
  const Face* faces = g.faces + shape.first_face;
  const auto from = [&](const Face& f) DECANT_INLINE {
    return Float3{x.x - fminf(fmaxf(x.x, f.min.x), f.max.x), x.y - fminf(fmaxf(x.y, f.min.y), f.max.y),
                  x.z - fminf(fmaxf(x.z, f.min.z), f.max.z)};
  };
  float best = 3.0e38f;
  int number = 0;
#pragma unroll 4
  for (int k = team.lane(); k < shape.faces; k += Team::lanes) {
    const Float3 to_x = from(faces[k]);
    number = dot(to_x, to_x) < best ? k : number;
    best = lesser(dot(to_x, to_x), best);
  }
  team.find_least(best, number);
  const Face nearest = faces[number];
  const Float3 away = from(nearest);
  bool inside = false;
#pragma unroll 4
  for (int k = 0; k < shape.boxes; ++k) {
    const Box b = g.boxes[shape.first_box + k];
    inside = inside ||
             (x.x >= b.min.x && x.x <= b.max.x && x.y >= b.min.y && x.y <= b.max.y && x.z >= b.min.z && x.z <= b.max.z);
  }
  const float d = sqrtf(best), sign = inside ? -1.0f : 1.0f;
  if (d > 1e-6f * (fabsf(x.x) + fabsf(x.y) + fabsf(x.z))) return {sign * d, (sign / d) * away};
  const float side = static_cast<float>(nearest.side);
  return {sign * d,
          {nearest.axis == 0 ? side : 0.0f, nearest.axis == 1 ? side : 0.0f, nearest.axis == 2 ? side : 0.0f}};
}

/// Moves x to the contact distance and takes the approaching part of the relative velocity:
/// with j = (1 + e)|w·n|, normal part += j n, tangential part × max(0, 1 − f j/|w_t|).
DECANT_DEVICE void respond(const Constants& c, Float3 normal, float gap, const DevicePose* pose, Float3& x, Float3& v) {
  x = x + (c.contact_distance - gap) * normal;
  const Float3 v_wall = pose ? surface_velocity(*pose, x) : Float3{0, 0, 0};
  const Float3 w = v - v_wall;
  const float approach = dot(w, normal);
  if (!(approach < 0.0f)) return;
  const float impulse = -(1.0f + c.restitution) * approach;
  const Float3 tangential = w - approach * normal;
  const float slip = sqrtf(dot(tangential, tangential));
  const float keep = slip > 0.0f ? fmaxf(0.0f, 1.0f - c.friction * impulse / slip) : 0.0f;
  v = v_wall + (approach + impulse) * normal + keep * tangential;
}

/// Distance of a point from the box around a solid, container frame; 0 inside.
DECANT_DEVICE float distance_from_box(const Shape& shape, Float3 x) {
  const Float3 off{fmaxf(fmaxf(shape.low.x - x.x, x.x - shape.high.x), 0.0f),
                   fmaxf(fmaxf(shape.low.y - x.y, x.y - shape.high.y), 0.0f),
                   fmaxf(fmaxf(shape.low.z - x.z, x.z - shape.high.z), 0.0f)};
  return sqrtf(dot(off, off));
}

template <class Team>
DECANT_DEVICE Clearance clearance_of(const Team& team, const DeviceGeometry& g, const Shape& shape, Float3 x) {
  return shape.revolved ? revolved_clearance(team, g, shape, x) : box_clearance(team, g, shape, x);
}

/// All containers in turn, as they stand at the end of the substep. Returns a distance that all solids
/// keep from x at least: 0 after a push, or where periodic axes have solids everywhere.
template <class Team>
DECANT_DEVICE float collide(const Team& team, const Constants& c, const DeviceGeometry& g, const DevicePose* poses,
                            Float3& x, Float3& v) {
  const float reach = c.contact_distance;
  float clear = c.any_periodic ? 0.0f : 3.0e38f;
  for (int k = 0; k < g.containers; ++k) {
    const Shape shape = g.shape(k);
    for (int projection = 0; projection < 2; ++projection) {
      const Float3 local = rotate_back(poses[k], x - poses[k].translation);
      const float away = distance_from_box(shape, local);
      if (away > reach) {
        clear = lesser(clear, away);
        break;
      }
      const Clearance near = clearance_of(team, g, shape, local);
      if (!(near.distance < reach)) {
        clear = lesser(clear, near.distance);
        break;
      }
      respond(c, rotate(poses[k], near.normal), near.distance, &poses[k], x, v);
      clear = 0.0f;
    }
  }
  return clear;
}

/// The floor; whether it pushed.
DECANT_DEVICE bool collide_with_floor(const Constants& c, Float3& x, Float3& v) {
  if (!(c.has_floor && x.z - c.floor_height < c.contact_distance)) return false;
  respond(c, {0, 0, 1}, x.z - c.floor_height, nullptr, x, v);
  return true;
}

/// A distance from x within which there is no solid, at least; near a solid, what its outline says.
DECANT_DEVICE float clearance(const Constants& c, const DeviceGeometry& g, const DevicePose* poses, Float3 x) {
  float least = 3.0e38f;
  for (int k = 0; k < g.containers; ++k) {
    const Shape shape = g.shape(k);
    if (c.any_periodic) return 0.0f;
    const Float3 at = rotate_back(poses[k], x - poses[k].translation);
    const float away = distance_from_box(shape, at);
    least = lesser(least, away > 0.0f ? away : fmaxf(clearance_of(SubWarp<1>(0), g, shape, at).distance, 0.0f));
  }
  return least;
}

}  // namespace
}  // namespace decant::gpu
