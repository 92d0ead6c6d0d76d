/// \file
/// A scene in which nothing accelerates, so that where particles are is known to a few roundings.
#pragma once

#include "reference/scene.hpp"

namespace decant {

/// What is left of an acceleration in a force-free scene, at most, m/s²: pressures of 10⁻²⁴ times those of
/// sound at 1 m/s.
inline constexpr double force_free_acceleration = 1e-12;

/// The scene without gravity, viscosity and tension, with a millionth of the fluid's mass, and sound so slow
/// that no density, walls' included, makes a pressure that a velocity could show. Geometry, motion of walls,
/// contact and time step stay.
Scene force_free(const Scene& scene);

}  // namespace decant
