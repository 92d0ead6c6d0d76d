/// \file
/// Limits by rule.
#include "reference/scene_limits.hpp"

#include "reference/scene_checks.hpp"

#include <algorithm>

namespace decant {

SceneLimits limits_of(const Scene& scene) {
  const double sound = scene.fluid.sound_speed;
  double speed = expected_max_speed(scene);
  if (!scene.schedule.substeps_derived)
    speed = std::max(speed, 0.4 * scene.smoothing_length() / scene.time_step() - sound);
  return {speed, sound / 4, scene.fluid.rest_density * (1 + 1.0 / 16)};
}

}  // namespace decant
