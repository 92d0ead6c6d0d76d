/// \file
/// Each particle's score against the oracle at an instant of a live run.
#pragma once

#include "oracle/solution/tolerance.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <cstdint>
#include <string>

namespace decant::live {

struct Scores {
  Eigen::VectorXd values;  // N, largest |error| / tolerance of density, pressure and acceleration; ∞ where NaN
  double largest = 0;
  std::int64_t particle = -1;
  std::string field;  // of the largest
  double time = 0;    // s, of the instant
};

/// \param fields  the backend's at that state, which is fp32-representable
Scores scores_of(const Scene& scene, const Walls& walls, const WallSolution& volumes, const ParticleState& state,
                 const Fields& fields);

}  // namespace decant::live
