/// \file
/// Signed distance in the half-plane of a revolved outline, and to the faces of a box union.
#include "reference/distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace decant {
namespace {

/// Nearest point of a segment, 2D.
struct Nearest {
  double r, z, squared;
};

Nearest nearest_on(const ProfileEdge& e, double r, double z) {
  const double dr = e.r1 - e.r0, dz = e.z1 - e.z0;
  const double s = std::clamp(((r - e.r0) * dr + (z - e.z0) * dz) / (dr * dr + dz * dz), 0.0, 1.0);
  const double nr = e.r0 + s * dr, nz = e.z0 + s * dz;
  return {nr, nz, (r - nr) * (r - nr) + (z - nz) * (z - nz)};
}

int crossings_below(const std::vector<ProfileEdge>& edges, double r, double z) {
  int count = 0;
  for (const auto& e : edges) {
    if ((e.r0 > r) == (e.r1 > r)) continue;
    if (z > e.z0 + (r - e.r0) / (e.r1 - e.r0) * (e.z1 - e.z0)) ++count;
  }
  return count;
}

/// \param inside  (r, z) → whether a point is in the solid
template <class Inside>
SurfaceDistance revolved_distance(const std::vector<ProfileEdge>& edges, const Vec3& x, Inside inside) {
  const double r = std::hypot(x.x(), x.y()), z = x.z();
  Nearest best{0, 0, std::numeric_limits<double>::infinity()};
  const ProfileEdge* nearest_edge = &edges.front();
  for (const auto& e : edges) {
    const Nearest n = nearest_on(e, r, z);
    if (n.squared < best.squared) {
      best = n;
      nearest_edge = &e;
    }
  }
  const double d = std::sqrt(best.squared);
  const double sign = inside(r, z) ? -1.0 : 1.0;
  double normal_r, normal_z;
  if (d > 1e-12) {
    normal_r = sign * (r - best.r) / d;
    normal_z = sign * (z - best.z) / d;
  } else {
    const double dr = nearest_edge->r1 - nearest_edge->r0, dz = nearest_edge->z1 - nearest_edge->z0;
    const double length = std::hypot(dr, dz);
    normal_r = dz / length;
    normal_z = -dr / length;
  }
  const Vec3 meridian = r > 0 ? Vec3(x.x() / r, x.y() / r, 0.0) : Vec3::UnitX();
  return {sign * d, normal_r * meridian + Vec3(0, 0, normal_z)};
}

Vec3 offset_from(const BoxFace& face, const Vec3& x) { return x - x.cwiseMax(face.min).cwiseMin(face.max); }

/// \param inside  x → whether it is in the solid
template <class Inside>
SurfaceDistance box_distance(const std::vector<BoxFace>& faces, const Vec3& x, Inside inside) {
  double best = std::numeric_limits<double>::infinity();
  Vec3 offset = Vec3::Zero();
  const BoxFace* at = nullptr;
  for (const auto& face : faces) {
    const Vec3 to_x = offset_from(face, x);
    const double squared = to_x.squaredNorm();
    if (squared < best) {
      best = squared;
      offset = to_x;
      at = &face;
    }
  }
  const double d = std::sqrt(best);
  const double sign = inside(x) ? -1.0 : 1.0;
  if (d > 1e-12) return {sign * d, sign * offset / d};
  return {0.0, at->side * Vec3::Unit(at->axis)};
}

}  // namespace

SolidDistance::SolidDistance(const Container& container)
    : revolved_(std::holds_alternative<RevolvedShape>(container.shape)) {
  low_.setConstant(std::numeric_limits<double>::infinity());
  high_ = -low_;
  if (revolved_) {
    edges_ = surface_edges(std::get<RevolvedShape>(container.shape));
    for (const auto& e : edges_) {
      const double r = std::max(e.r0, e.r1);
      low_ = low_.cwiseMin(Vec3(-r, -r, std::min(e.z0, e.z1)));
      high_ = high_.cwiseMax(Vec3(r, r, std::max(e.z0, e.z1)));
    }
  } else {
    box_ = std::get<BoxShape>(container.shape);
    faces_ = exposed_faces(box_);
    for (const auto& b : box_.solid) {
      low_ = low_.cwiseMin(b.min);
      high_ = high_.cwiseMax(b.max);
    }
  }
}

SurfaceDistance SolidDistance::at(const Vec3& local) const {
  if (revolved_)
    return revolved_distance(edges_, local,
                             [&](double r, double z) { return crossings_outward(edges_, r, z) % 2 == 1; });
  return box_distance(faces_, local, [&](const Vec3& x) { return in_solid(box_.solid, x); });
}

SolidDistance::Nearby SolidDistance::nearby(const Vec3& around, double distance, double radius) const {
  Nearby nearby(*this);
  const double rounding = 1e-12 * (around.norm() + low_.norm() + high_.norm() + radius);
  const double farthest = std::abs(distance) + 2 * radius + rounding, squared = farthest * farthest;
  if (revolved_) {
    const double r = std::hypot(around.x(), around.y());
    for (const ProfileEdge& e : edges_)
      if (!(nearest_on(e, r, around.z()).squared > squared)) nearby.edges_.push_back(e);
  } else {
    for (const BoxFace& f : faces_)
      if (!(offset_from(f, around).squaredNorm() > squared)) nearby.faces_.push_back(f);
  }
  if (std::abs(distance) > radius + rounding) nearby.sign_ = distance < 0 ? -1 : 1;
  return nearby;
}

SurfaceDistance SolidDistance::Nearby::at(const Vec3& local) const {
  if (solid_.revolved_)
    return revolved_distance(edges_, local, [&](double r, double z) {
      return sign_ == 0 ? crossings_outward(solid_.edges_, r, z) % 2 == 1 : sign_ < 0;
    });
  return box_distance(faces_, local,
                      [&](const Vec3& x) { return sign_ == 0 ? in_solid(solid_.box_.solid, x) : sign_ < 0; });
}

bool SolidDistance::in_cavity(const Vec3& local) const {
  if (!revolved_)
    return (local.array() >= box_.cavity.min.array()).all() && (local.array() <= box_.cavity.max.array()).all() &&
           !in_solid(box_.solid, local);
  const double r = std::hypot(local.x(), local.y());
  const int outward = crossings_outward(edges_, r, local.z());
  return outward > 0 && outward % 2 == 0 && crossings_below(edges_, r, local.z()) > 0;
}

}  // namespace decant
