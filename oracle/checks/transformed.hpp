/// \file
/// The same problem told otherwise: ids permuted, everything moved, everything turned. Physics does not
/// care, and neither may a backend.
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <string>
#include <vector>

namespace decant {

struct TransformedProblem {
  std::string name;  // "permuted", "translated", "rotated"
  Scene scene;
  ParticleState state;                 // fp32-representable
  std::vector<Eigen::Index> original;  // N, whose id each particle had
};

/// Ids in an order drawn from `seed`; moved by half a meter along every axis, then rounded to fp32;
/// turned by a quarter about the world's z axis, (x, y, z) → (−y, x, z), which is exact.
std::vector<TransformedProblem> transformed_problems(const Scene& scene, const ParticleState& state, unsigned seed = 1);

}  // namespace decant
