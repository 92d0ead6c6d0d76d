/// \file
/// What particles are colored by, and the ends of its scale.
#pragma once

#include "oracle/checks/audit.hpp"
#include "tools/live/picture.hpp"
#include "tools/live/scores.hpp"

namespace decant::live {

/// The scale that fits the scene: speed up to the one that its time step was derived for, v; density ρ0 ± 5 %; pressure
/// up to ρ0 v²/2; region and score: see color.
Colors scale_of(Quantity quantity, const Scene& scene);

/// Fills in the values; those of density and pressure are there. \param audit  filled where the quantity is a region;
/// \param scores  null: none yet. Their scale goes from 0 to 1, or to the largest.
void color(Colors& colors, const ParticleState& state, const AuditResult& audit, const Scores* scores);

}  // namespace decant::live
