/// \file
/// The fluid a scene starts with.
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

namespace decant {

/// Lattice of spacing dx in every fill, dx/2 away from the surfaces, particles in fill order, x
/// fastest, rounded to fp32. Throws std::runtime_error where a fill holds no particle.
ParticleState initial_state(const Scene& scene);

}  // namespace decant
