/// \file
/// What a scene's time step and speed of sound were chosen for. A run that goes beyond is not refused,
/// but must say so.
#pragma once

#include "reference/scene.hpp"

namespace decant {

struct SceneLimits {
  /// m/s, the speed that the substep was derived for: expected_max_speed; of a scene that sets its substeps
  /// and a slower speed than they allow, the speed they allow, 0.4 h/dt − c0.
  double time_step_speed;
  /// m/s, c0/4, the largest speed that any scene may expect.
  double sound_speed_quarter;
  /// kg/m³, rho0 (1 + (1/4)²): compression goes with (v/c0)², and no scene may expect more.
  double density;
};

/// Throws InputError as expected_max_speed does.
SceneLimits limits_of(const Scene& scene);

}  // namespace decant
