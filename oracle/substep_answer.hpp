/// \file
/// One substep of the oracle with the tolerance of every position and velocity. Contact is a
/// discontinuity: particles whose contact, or whose nearest face, fp32 cannot decide are named and
/// counted instead of widening the tolerance for all.
#pragma once

#include "oracle/tolerance.hpp"

namespace decant {

struct SubstepAnswer {
  ParticleState state;                   // after the substep
  Eigen::Matrix3Xd position_tolerance;   // 3×N, m
  Eigen::Matrix3Xd velocity_tolerance;   // 3×N, m/s
  std::vector<bool> ambiguous;           // N
  std::int64_t most_ambiguous = 0;       // 2 % of the particles, and ten
};

/// tau_v = dt tau_a + 2u(|v| + dt|a|), tau_x = dt tau_v + 2u(|x| + dt|v|), and at every contact
/// tau_x += (phi_c − phi) tau_n + e, tau_v += 2|w| tau_n + 2|omega| tau_x: e the error of the
/// distance (pose rounding and tau_x), tau_n how far the normal turns within e, w the velocity
/// relative to the wall.
/// \param fields  the oracle's answer at `state`
SubstepAnswer substep_answer(const Scene& scene, const ParticleState& state,
                             const OracleAnswer& fields);

}  // namespace decant
