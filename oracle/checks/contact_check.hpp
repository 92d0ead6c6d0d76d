/// \file
/// The check `contact`: what walls make of particles whose place and velocity before the contact are known
/// to a few roundings, so that nothing upstream hides an error.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/checks/comparison.hpp"
#include "oracle/solution/fixture.hpp"
#include "oracle/solution/substep_solution.hpp"

#include <string>
#include <vector>

namespace decant {

/// Probes in the force-free scene, and what the oracle makes of them.
struct ContactProblem {
  Scene scene;
  ParticleState state;
  /// One substep on, per probe.
  std::vector<std::vector<SubstepOutcome>> first;
  /// contact_run substeps on, of the probes whose contacts can be told until then; these and their ids.
  std::vector<std::vector<SubstepOutcome>> later;
  std::vector<Eigen::Index> later_id;
};

/// Substeps of the run, in which probes meet walls after some flight, and walls probes at rest.
inline constexpr int contact_run = 8;

/// Problems of a fixture, from its scene and state alone, the same on every machine:
/// as the scene has it, the fixture's own particles that touch a wall in the next substep, as they are
/// after the oracle's acceleration, and probes around every edge and face of every container and the floor,
/// shallow and deep, approaching, sliding, receding and at rest; where there is something that this leaves
/// out, probes when walls move fastest, with a restitution and a friction where the scene has none.
/// Probes that leave the domain or whose nearest face cannot be told are left out.
/// \param acceleration  3×N, m/s², the oracle's
std::vector<ContactProblem> contact_problems(const Scene& scene, const ParticleState& state,
                                             const Eigen::Matrix3Xd& acceleration);

/// Rows position and velocity, one substep on and after the run.
void check_contact(Backend& backend, const Walls& walls, const std::vector<ContactProblem>& problems,
                   RowBuilder& builder);

}  // namespace decant
