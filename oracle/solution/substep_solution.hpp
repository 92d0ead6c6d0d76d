/// \file
/// One substep of the oracle with the tolerance of every position and velocity. Contact is a
/// discontinuity: where fp32 cannot decide whether a particle touches, a backend may answer either
/// way, and each answer has its own narrow tolerance; nothing is widened.
#pragma once

#include "oracle/solution/tolerance.hpp"

namespace decant {

/// What a particle may be after the substep, and how precisely.
struct SubstepOutcome {
  Vec3 position, velocity;                      // m, m/s
  Vec3 position_tolerance, velocity_tolerance;  // m, m/s
};

/// Moves each position by whole periods to where it is nearest to the first outcome's, so that what one contact
/// decides is never a period.
void gather_images(const Domain& domain, std::vector<SubstepOutcome>& outcomes);

struct SubstepSolution {
  /// Per particle the oracle's own outcome, then those with its undecidable contacts decided
  /// otherwise, by the image nearest to it.
  std::vector<std::vector<SubstepOutcome>> outcomes;
  /// Particles left out: the nearest face cannot be told, or more than three contacts are open. Which
  /// side of a period a particle comes back in on does not matter: positions are compared by images.
  std::vector<bool> ambiguous;      // N
  std::int64_t most_ambiguous = 0;  // 2 % of the particles, and ten
  /// How far walls push any of those left out, all pushes of its substep together, m: one whose face
  /// cannot be told may be pushed twice as far the other way.
  double longest_push = 0;
};

/// tau_v = dt tau_a + 2u (|v| + dt|a|) + 3N, tau_x = dt tau_v + u (2|x| + 4 dt|v|) + 3N, N = 2⁻¹²⁶, and what contacts
/// make of them (contact_bounds.hpp).
/// \param fields  the oracle's answer at `state`
SubstepSolution substep_solution(const Scene& scene, const ParticleState& state, const ReferenceSolution& fields);

}  // namespace decant
