/// \file
/// Pressure from density: p = B((ρ/ρ0)^γ − 1), γ 7 (Becker & Teschner 2007) or 1.
#pragma once

#include "gpu/physics/vectors.cuh"

namespace decant::gpu {
namespace {

/// p(rho), Pa.
DECANT_DEVICE float pressure_at(const Constants& c, float density) {
  const float s = density * c.inverse_rest_density;
  float power = s;
  if (c.eos_exponent == 7) {
    const float s2 = s * s;
    power = s2 * s2 * s2 * s;
  }
  const float p = c.stiffness * (power - 1.0f);
  return c.allow_tension || !(p < 0.0f) ? p : 0.0f;
}

}  // namespace
}  // namespace decant::gpu
