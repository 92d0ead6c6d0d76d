/// \file
/// Numbers that follow from a scene by rule: the speed to expect, the substeps, the spacing for a
/// number of particles.
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/pose.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_json_reader.hpp"
#include "reference/sweep.hpp"

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

const Container* container_of(const Scene& scene, const Fill& fill) {
  for (const auto& c : scene.containers)
    if (c.name == fill.container) return &c;
  return nullptr;
}

/// Lowest elevation (along `up`) where falling fluid is caught, m.
double catching_elevation(const Scene& scene, const Vec3& up) {
  const auto box_elevation = [&](const Vec3& min, const Vec3& max) {
    return up.cwiseProduct(min).cwiseMin(up.cwiseProduct(max)).sum();
  };
  if (scene.floor) {
    Vec3 min = scene.domain.min, max = scene.domain.max;
    min.z() = max.z() = scene.floor->height;
    return box_elevation(min, max);
  }
  double lowest = infinity;
  for (const auto& c : scene.containers)
    lowest = std::min(lowest, -farthest_along(-up, cavity_bottom_rings(c), &c, scene.schedule.end));
  return std::isfinite(lowest) ? lowest : box_elevation(scene.domain.min, scene.domain.max);
}

/// Of a linear field over a convex hull: at a corner.
double fastest_start(const Fill& fill, const std::vector<Ring>& rings, const Container* container) {
  const Pose pose = container ? pose_at(*container, 0.0) : Pose{};
  double fastest = 0;
  for (const Ring& ring : rings)
    for (const double side_x : {-1.0, 1.0})
      for (const double side_y : {-1.0, 1.0}) {
        const Vec3 corner = ring.center + ring.radius * Vec3(side_x, side_y, 0);
        fastest = std::max(fastest, fill.velocity_at(pose.to_world(corner)).norm());
      }
  return fastest;
}

/// Greatest speed of any wall, whether it holds a fill or not, m/s: fluid that it meets is as fast. Of
/// `own`, whose fluid moves along, the speed of the surface alone.
double fastest_wall(const Scene& scene, const Container* own) {
  double fastest = 0;
  for (const auto& c : scene.containers)
    fastest = std::max(fastest, c.surface_velocity.norm() + (&c == own ? 0.0 : fastest_point(solid_rings(c), c)));
  return fastest;
}

std::int64_t particles_at(Scene scene, double spacing) {
  scene.particle_spacing = spacing;
  try {
    return initial_state(scene).size();
  } catch (const std::runtime_error&) {
    return 0;  // a fill that holds none
  }
}

}  // namespace

double longest_time_step(const Scene& scene, double courant, double max_speed) {
  const double h = scene.smoothing_length();
  // Wall terms reach half a particle's surroundings at most, so mu_w counts half.
  const double viscosity = std::max(scene.fluid.viscosity, 0.5 * scene.fluid.wall_viscosity);
  const double viscous = viscosity > 0 ? 0.125 * h * h * scene.fluid.rest_density / viscosity : infinity;
  return std::min(courant * h / (scene.fluid.sound_speed + max_speed), viscous);
}

double expected_max_speed(const Scene& scene) {
  if (scene.schedule.max_speed) return *scene.schedule.max_speed;
  const double gravity = scene.gravity.norm();
  for (int a = 0; a < 3; ++a)
    if (scene.domain.periodic[static_cast<std::size_t>(a)] && scene.gravity[a] != 0.0)
      throw InputError(scene.name, "time.max_speed", "missing",
                       "required (m/s), because gravity pulls along the periodic axis " + std::string(1, "xyz"[a]) +
                           " and no fall height bounds the speed");
  const Vec3 up = gravity > 0 ? Vec3(-scene.gravity / gravity) : Vec3::UnitZ();
  const double caught = gravity > 0 ? catching_elevation(scene, up) : 0.0;
  double fastest = scene.fills.empty() ? fastest_wall(scene, nullptr) : 0.0;
  for (const auto& fill : scene.fills) {
    const Container* container = container_of(scene, fill);
    const auto rings = fill_rings(fill, container);
    double start = std::max(fastest_start(fill, rings, container), fastest_wall(scene, container));
    if (container) start = std::max(start, fastest_point(rings, *container));
    double fall = 0;
    if (gravity > 0) fall = std::max(0.0, farthest_along(up, rings, container, scene.schedule.end) - caught);
    fastest = std::max(fastest, std::sqrt(start * start + 2 * gravity * fall));
  }
  return fastest;
}

int substeps_for(const Scene& scene) {
  const double longest = longest_time_step(scene, scene.schedule.courant, expected_max_speed(scene));
  const double frame = scene.schedule.end / scene.schedule.frames;
  const double needed = std::ceil(frame / longest);
  if (!(needed < 1e9))
    throw InputError(
        scene.name, "time.frames", std::to_string(scene.schedule.frames),
        "more frames or a shorter end: a frame would need " + to_text(needed) + " substeps, and 1e9 is the most");
  Scene trial = scene;
  // From just below, so that rounding of the quotient cannot add one.
  trial.schedule.substeps_per_frame = std::max(1, static_cast<int>(needed) - 1);
  while (trial.time_step() > longest) ++trial.schedule.substeps_per_frame;
  return trial.schedule.substeps_per_frame;
}

Scene with_particles(Scene scene, std::int64_t particles) {
  const std::int64_t most = 1000000000;
  if (particles < 1 || particles > most)
    throw InputError(scene.name, "particles", std::to_string(particles),
                     "an integer in [1, " + std::to_string(most) + "]");
  const auto error_of = [&](std::int64_t count) {
    return std::abs(static_cast<double>(count) / static_cast<double>(particles) - 1.0);
  };
  double best = scene.particle_spacing, best_error = infinity;
  const auto count_at = [&](double spacing) {
    const std::int64_t count = particles_at(scene, spacing);
    if (error_of(count) < best_error) {
      best = spacing;
      best_error = error_of(count);
    }
    return count;
  };
  const double close = 0.005;
  double spacing = scene.particle_spacing;
  for (int k = 0; k < 12 && best_error > close; ++k) {
    const std::int64_t count = count_at(spacing);
    // A spacing at which a fill holds nothing says only that it is too coarse.
    spacing *= count == 0 ? 0.5 : std::cbrt(static_cast<double>(count) / static_cast<double>(particles));
  }
  // The count jumps with the spacing, so the steps above can circle about the request.
  const double centre = best;
  for (int k = 1; k <= 40 && best_error > close; ++k)
    for (double side : {-1.0, 1.0})
      if (best_error > close) count_at(centre * (1 + side * 0.002 * k));
  scene.particle_spacing = best;
  if (scene.schedule.substeps_derived) scene.schedule.substeps_per_frame = substeps_for(scene);
  return scene;
}

}  // namespace decant
