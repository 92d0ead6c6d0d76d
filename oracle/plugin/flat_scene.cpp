/// \file
/// Copies value by value, so that the layout of Scene may change.
#include "oracle/plugin/flat_scene.hpp"

#include "reference/pose.hpp"

#include <algorithm>
#include <utility>

namespace decant {
namespace {

void put_pose(const Pose& pose, decant_pose& out) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation = pose.rotation;
  std::copy_n(rotation.data(), 9, out.rotation);
  std::copy_n(pose.translation.data(), 3, out.translation);
  std::copy_n(pose.pivot.data(), 3, out.pivot);
  std::copy_n(pose.angular_velocity.data(), 3, out.angular_velocity);
  std::copy_n(pose.linear_velocity.data(), 3, out.linear_velocity);
  std::copy_n(pose.surface_velocity.data(), 3, out.surface_velocity);
}

}  // namespace

decant_scene flat_scene(const Scene& scene) {
  decant_scene s{};
  s.size = sizeof s;
  s.kernel = static_cast<std::int32_t>(scene.kernel);
  s.particle_spacing = scene.particle_spacing;
  s.support_radius = scene.support_radius();
  s.particle_mass = scene.particle_mass();
  s.rest_density = scene.fluid.rest_density;
  s.sound_speed = scene.fluid.sound_speed;
  s.eos_exponent = scene.fluid.eos_exponent;
  s.eos_stiffness = scene.eos_stiffness();
  s.allow_tension = scene.fluid.allow_tension;
  s.viscosity = scene.fluid.viscosity;
  s.wall_viscosity = scene.fluid.wall_viscosity;
  for (int k = 0; k < 3; ++k) {
    s.gravity[k] = scene.gravity[k];
    s.domain_min[k] = scene.domain.min[k];
    s.domain_max[k] = scene.domain.max[k];
    s.periodic[k] = scene.domain.periodic[static_cast<std::size_t>(k)];
  }
  s.has_floor = scene.floor.has_value();
  s.floor_height = scene.floor ? scene.floor->height : 0;
  s.contact_distance = scene.contact_distance();
  s.restitution = scene.contact.restitution;
  s.friction = scene.contact.friction;
  s.time_step = scene.time_step();
  s.containers = static_cast<std::int32_t>(scene.containers.size());
  return s;
}

SceneCallbacks::SceneCallbacks(std::vector<Container> containers) : containers_(std::move(containers)) {
  for (const Container& container : containers_) solids_.emplace_back(container);
}

void SceneCallbacks::attach(decant_scene& scene) const {
  scene.host = this;
  scene.pose = [](const void* host, std::int32_t k, double time, decant_pose* out) {
    const auto& self = *static_cast<const SceneCallbacks*>(host);
    put_pose(pose_at(self.containers_.at(static_cast<std::size_t>(k)), time), *out);
  };
  scene.distance = [](const void* host, std::int32_t k, const double* point, double* normal) {
    const auto& self = *static_cast<const SceneCallbacks*>(host);
    const SurfaceDistance found = self.solids_.at(static_cast<std::size_t>(k)).at(Eigen::Map<const Vec3>(point));
    if (normal) std::copy_n(found.normal.data(), 3, normal);
    return found.distance;
  };
}

}  // namespace decant
