/// \file
/// What particles are colored by, and the ends of its scale.
#pragma once

#include "oracle/checks/audit.hpp"
#include "tools/live/picture.hpp"
#include "tools/live/scores.hpp"

#include <memory>

namespace decant::live {

/// The scale that fits the scene: speed up to the one that its time step was derived for, v; density ρ0 ± 5 %; pressure
/// up to ρ0 v²/2; score up to 1, whose color all have that do not conform.
Colors scale_of(Quantity quantity, const Scene& scene);

/// What was found out beside the loop, of an instant a little earlier; null: nothing yet.
struct Results {
  std::shared_ptr<const AuditResult> audit;
  std::shared_ptr<const Scores> scores;
};

/// Fills in the values; those of density and pressure are there.
void color(Colors& colors, const ParticleState& state, const Results& results);

}  // namespace decant::live
