/// \file
/// From scene data to device constants.
#include "gpu/core/device_scene.hpp"

#include "reference/pose.hpp"
#include "reference/scene.hpp"
#include "reference/shapes.hpp"
#include "reference/state.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace decant::gpu {
namespace {

Float3 to_float3(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// A box around a container's solid, in its frame.
struct Bounds {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;

  explicit Bounds(const Container& container) {
    if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
      for (const ProfileEdge& e : surface_edges(*revolved)) {
        const double r = std::max(e.r0, e.r1);
        low = low.cwiseMin(Vec3(-r, -r, std::min(e.z0, e.z1)));
        high = high.cwiseMax(Vec3(r, r, std::max(e.z0, e.z1)));
      }
    } else {
      for (const SolidBox& b : std::get<BoxShape>(container.shape).solid) {
        low = low.cwiseMin(b.min);
        high = high.cwiseMax(b.max);
      }
    }
  }
  Vec3 corner(int k) const {
    return {k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z()};
  }
};

/// How far a point of the box moves from one pose to the next, at most: a corner moves farthest, since
/// displacements are affine in the place. What fp32 makes of either pose is added.
class FarthestMove {
 public:
  explicit FarthestMove(const Container& container) : moves_(moves(container)), box_(container) {}
  /// From the pose of the call before; 0 the first time.
  double operator()(const Pose& pose) {
    if (!moves_) return 0;
    double square = 0, extent = 0;
    for (int k = 0; k < 8; ++k) {
      const Vec3 local = box_.corner(k), after = pose.to_world(local);
      if (!first_) square = std::max(square, (after - before_[k]).squaredNorm());
      extent = std::max({extent, after.squaredNorm(), local.squaredNorm()});
      before_[k] = after;
    }
    first_ = false;
    return square > 0 ? std::sqrt(square) + 0x1p-19 * std::sqrt(extent) : 0;
  }

 private:
  bool moves_, first_ = true;
  Bounds box_;
  std::array<Vec3, 8> before_;
};

/// The same surface in fewer rectangles: two that share an edge of theirs and lie in one plane become one.
std::vector<BoxFace> merged(std::vector<BoxFace> faces) {
  const auto join = [](BoxFace& a, const BoxFace& b) {
    if (a.axis != b.axis || a.side != b.side) return false;
    for (int along = 0; along < 3; ++along) {
      bool side_by_side = along != a.axis && (a.max[along] == b.min[along] || b.max[along] == a.min[along]);
      for (int k = 0; k < 3; ++k) side_by_side &= k == along || (a.min[k] == b.min[k] && a.max[k] == b.max[k]);
      if (!side_by_side) continue;
      a.min = a.min.cwiseMin(b.min);
      a.max = a.max.cwiseMax(b.max);
      return true;
    }
    return false;
  };
  for (std::size_t k = 0; k < faces.size();) {
    const auto other = std::find_if(faces.begin() + static_cast<std::ptrdiff_t>(k) + 1, faces.end(),
                                    [&](const BoxFace& f) { return join(faces[k], f); });
    if (other == faces.end()) {
      ++k;
      continue;
    }
    faces.erase(other);
    k = 0;  // what was joined may join others
  }
  return faces;
}

}  // namespace

Constants make_constants(const Scene& scene) {
  Constants c{};
  const double H = scene.support_ratio * scene.particle_spacing, h = H / 2;
  const double pi = std::numbers::pi;
  const double h3 = h * h * h, h5 = h3 * h * h, H3 = H * H * H;
  switch (scene.kernel) {
    case KernelFamily::cubic_spline:
      c.kernel = KernelId::cubic_spline;
      c.w_norm = static_cast<float>(1.0 / (pi * h3));
      c.g_norm = static_cast<float>(1.0 / (pi * h5));
      c.g_near[0] = static_cast<float>(3.0 / (pi * h5));
      c.g_near[1] = static_cast<float>(2.25 / (pi * h5));
      c.g_far = static_cast<float>(0.75 * h / (pi * h5));
      break;
    case KernelFamily::wendland_c2:
      c.kernel = KernelId::wendland_c2;
      c.w_norm = static_cast<float>(21.0 / 16.0 / (pi * h3));
      c.g_norm = static_cast<float>(105.0 / 16.0 / (pi * h5));
      break;
    case KernelFamily::mueller2003:
      // poly6 is evaluated in (r/H)², so its norm is per H³.
      c.kernel = KernelId::mueller2003;
      c.w_norm = static_cast<float>(315.0 / 64.0 / (pi * H3));
      c.g_norm = static_cast<float>(45.0 / (pi * H3 * H3));
      break;
  }
  c.H = static_cast<float>(H);
  c.H2 = static_cast<float>(H * H);
  c.inverse_h = static_cast<float>(1.0 / h);
  c.h2_soft = static_cast<float>(0.01 * h * h);
  const FluidProperties& fluid = scene.fluid;
  c.spacing = static_cast<float>(scene.particle_spacing);
  c.mass = static_cast<float>(scene.particle_mass());
  c.rest_density = static_cast<float>(fluid.rest_density);
  c.inverse_rest_density = static_cast<float>(1.0 / fluid.rest_density);
  c.stiffness = static_cast<float>(fluid.rest_density * fluid.sound_speed * fluid.sound_speed / fluid.eos_exponent);
  c.eos_exponent = static_cast<int>(fluid.eos_exponent);
  c.allow_tension = fluid.allow_tension;
  c.viscosity = static_cast<float>(fluid.viscosity);
  c.wall_viscosity = static_cast<float>(fluid.wall_viscosity);
  c.gravity = to_float3(scene.gravity);
  c.dt = static_cast<float>(scene.time_step());
  c.contact_distance = static_cast<float>(scene.contact.distance_ratio * scene.particle_spacing);
  c.restitution = static_cast<float>(scene.contact.restitution);
  c.friction = static_cast<float>(scene.contact.friction);
  c.has_floor = scene.floor.has_value();
  c.floor_height = scene.floor ? static_cast<float>(scene.floor->height) : 0.0f;
  for (int a = 0; a < 3; ++a) {
    c.periodic[a] = scene.domain.periodic[a];
    c.any_periodic = c.any_periodic || c.periodic[a];
    c.domain_min[a] = static_cast<float>(scene.domain.min[a]);
    c.domain_max[a] = static_cast<float>(scene.domain.max[a]);
    const double period = scene.domain.max[a] - scene.domain.min[a];
    c.period[a] = c.periodic[a] ? static_cast<float>(period) : 0.0f;
    c.inverse_period[a] = c.periodic[a] ? static_cast<float>(1.0 / period) : 0.0f;
  }
  return c;
}

Geometry make_geometry(const Scene& scene) {
  Geometry g;
  for (const Container& container : scene.containers) {
    Shape shape{};
    const Bounds box(container);
    shape.first_edge = static_cast<int>(g.edges.size());
    shape.first_box = static_cast<int>(g.boxes.size());
    shape.first_face = static_cast<int>(g.faces.size());
    if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
      shape.revolved = true;
      for (const ProfileEdge& e : surface_edges(*revolved)) {
        const double dr = e.r1 - e.r0, dz = e.z1 - e.z0;
        g.edges.push_back({static_cast<float>(e.r0), static_cast<float>(e.z0), static_cast<float>(dr),
                           static_cast<float>(dz), static_cast<float>(e.z1),
                           static_cast<float>(1 / (dr * dr + dz * dz)), dz != 0 ? static_cast<float>(dr / dz) : 0.0f});
      }
    } else {
      const auto& boxes = std::get<BoxShape>(container.shape);
      for (const SolidBox& b : boxes.solid) g.boxes.push_back({to_float3(b.min), to_float3(b.max)});
      for (const BoxFace& f : merged(exposed_faces(boxes)))
        g.faces.push_back({to_float3(f.min), to_float3(f.max), f.axis, f.side});
    }
    shape.edges = static_cast<int>(g.edges.size()) - shape.first_edge;
    shape.boxes = static_cast<int>(g.boxes.size()) - shape.first_box;
    shape.faces = static_cast<int>(g.faces.size()) - shape.first_face;
    shape.low = to_float3(box.low);
    shape.high = to_float3(box.high);
    g.shapes.push_back(shape);
  }
  return g;
}

Box make_region(const Scene& scene) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
  for (const Container& container : scene.containers) {
    const Pose pose = pose_at(container, 0);
    const Bounds bounds(container);
    for (int k = 0; k < 8; ++k) {
      const Vec3 corner = pose.to_world(bounds.corner(k));
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  for (const Fill& fill : scene.fills) {
    // A fill that names a container lies in it.
    if (!fill.box || !fill.container.empty()) continue;
    low = low.cwiseMin(fill.box->min);
    high = high.cwiseMax(fill.box->max);
  }
  low = low.cwiseMax(scene.domain.min);
  high = high.cwiseMin(scene.domain.max);
  if (!(low.array() <= high.array()).all()) return {to_float3(scene.domain.min), to_float3(scene.domain.max)};
  return {to_float3(low), to_float3(high)};
}

WallSamples make_wall_samples(const Scene& scene, const Walls& walls) {
  WallSamples samples;
  samples.container_begin.push_back(0);
  for (std::size_t c = 0; c < walls.containers.size(); ++c) {
    const auto& x = walls.containers[c].position;
    for (Eigen::Index k = 0; k < x.cols(); ++k) {
      samples.x.push_back(static_cast<float>(x(0, k)));
      samples.y.push_back(static_cast<float>(x(1, k)));
      samples.z.push_back(static_cast<float>(x(2, k)));
    }
    samples.container_begin.push_back(static_cast<int>(samples.x.size()));
    samples.container_moves.push_back(moves(scene.containers[c]));
  }
  return samples;
}

std::vector<DevicePose> make_poses(const Scene& scene, std::int64_t first, int count) {
  std::vector<DevicePose> poses;
  poses.reserve(static_cast<std::size_t>(count) * scene.containers.size());
  std::vector<FarthestMove> move(scene.containers.begin(), scene.containers.end());
  for (int k = 0; k < count; ++k)
    for (std::size_t s = 0; s < scene.containers.size(); ++s) {
      const Container& container = scene.containers[s];
      const Pose pose = pose_at(container, scene.time_at(first + k));
      DevicePose d{};
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          d.R[3 * row + column] = static_cast<float>(pose.rotation(row, column));
      d.translation = to_float3(pose.translation);
      d.pivot = to_float3(pose.pivot);
      d.omega = to_float3(pose.angular_velocity);
      d.surface = to_float3(pose.linear_velocity + pose.surface_velocity);
      d.step = static_cast<float>(move[s](pose));
      poses.push_back(d);
    }
  return poses;
}

}  // namespace decant::gpu
