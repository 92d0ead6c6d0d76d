/// \file
/// What `decant conform --explain` says.
#include "oracle/checks/checks.hpp"

#include "reference/error.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace decant {

namespace {
constexpr std::array<std::string_view, 7> rows_of_fields = {
    "neighbors", "boundary_volume", "density", "pressure", "equation_of_state", "acceleration", "evaluation"};
}

const std::vector<CheckDescription>& check_descriptions() {
  static const std::vector<CheckDescription> checks = {
      {"fields",
       "Neighbor counts and id sums, boundary volumes, density, pressure and the four parts of the "
       "acceleration at the recorded state, particle by particle: first every stage from the "
       "backend's own stage before (neighbors, boundary_volume, density, pressure, evaluation), then "
       "pressure once more from the oracle's density (equation_of_state) and the accelerations from its "
       "density and pressure (acceleration), so that the first wrong stage is named.",
       "A sum, gravity one of its terms, differs in fp32 by what its additions lose in any order, terms "
       "that round alike adding up (oracle/solution/sum_bound.hpp), and by u Σ|t|(a + bκ): the terms' own "
       "condition κ = r|f'|/f is summed by the oracle for every particle (Higham, Accuracy and "
       "Stability, §3–4; Higham & Mary 2019); a and b count the roundings inside a term. Constants "
       "formed in fp32, poses of moving walls, the equation of state and what pressure hands on to "
       "accelerations have terms of their own. oracle/tolerances.md has every formula. "
       "Integers are exact, but for particles that own a pair too near H for fp32 to place; their "
       "number is bounded by four times what a fluid of this density has.",
       "A factor of 1 + 1e-5 on G, or on B and gamma where nothing is compressed by more than a percent."},
      {"substep", "Positions and velocities one substep on: integration, moving walls, contact.",
       "tau_v = dt tau_a + 2u(|v| + dt|a|), tau_x = dt tau_v + u(2|x| + 4 dt|v|), and what contacts "
       "make of them (oracle/solution/contact_bounds.hpp). Where fp32 cannot tell whether a particle touches, either "
       "answer may be given, each with its own narrow tolerance.",
       "What only shows over many substeps."},
      {"contact",
       "What walls make of particles whose place and velocity before the contact are known to a few "
       "roundings: one substep, and eight, of a scene without forces. Particles of the fixture that touch "
       "a wall in the next substep, and probes around every edge and face of every container and the "
       "floor, shallow and deep, approaching, sliding, receding, at rest, after some flight; once more "
       "when walls move fastest, with a restitution and a friction where the scene has none.",
       "Nothing before the contact but u(2|x| + 4 dt|v|) of the position; then what distance, normal and "
       "wall velocity add in any legal form (oracle/solution/contact_bounds.hpp). Probes whose nearest face fp32 "
       "cannot tell are left out beforehand.",
       "A friction or a restitution wrong by 1e-5."},
      {"advanced",
       "Neighbor counts and id sums, density, pressure and accelerations after some substeps, from what "
       "the backend has in use then: kept lists, sorted orders, positions of walls. The state is read and "
       "the oracle answers there; the backend is not loaded again in between.",
       "As of `fields`, at the state that was read.",
       "What a backend keeps for its runs and does not use when it evaluates."},
      {"trajectory",
       "How far the backend is from the oracle after some tens of substeps: RMS and 99th percentile of "
       "position and velocity, and the total energy.",
       "3 (mean + 6 standard deviations) of an ensemble of oracle runs recorded in the fixture: x and v "
       "perturbed by fp32's rounding before every substep, and every constant once. The 3 is √9, the "
       "roundings of a contact beside the one that a perturbation stands for (oracle/solution/ensemble.hpp). RMS "
       "and percentile, because the maximum over thousands of particles is decided by one collision. A "
       "viscosity wrong by 1 % shows in the energy of settled and splashing fluid.",
       "An error below rounding, however systematic."},
      {"mass",
       "After the run every id is there once and finite, and no more are outside the domain than in the oracle's "
       "run; the particles of all regions (source, in flight, receiver, spilled, lost) add up to all particles.",
       "Exact: counts. Two with the same position and velocity, bit for bit, are one too many, unless the "
       "oracle has them in one place as well or they started as one.",
       "Two ids exchanged (fields and substep see that)."},
      {"containment",
       "Depth inside any wall and paths through walls during the run, judged in double from positions and "
       "from the way between two samples, in each container's own frame.",
       "No deeper, and no more crossings, than the oracle's own run shows; where that is inside a wall "
       "itself, or there is a floor, a distance's rounding of 8 u X deeper; elsewhere what of that exceeds "
       "the contact distance.",
       "What happens between two samples and is undone."},
      {"determinism",
       "Two evaluations and two runs from the same state give the same bits, and the same numbers of rebuilds "
       "and, where lists verify themselves, of pairs.",
       "Exact: the number of values that differ is 0.", "A race that did not happen this time."},
      {"conservation", "The forces between fluid particles sum to zero, pressure and viscosity apart: momentum.",
       "√Σ tau_i² of the particles' own tolerances: rounding errors of different particles are "
       "independent.",
       "A factor on all forces."},
      {"invariance",
       "Density, pressure and acceleration of the same state with its ids permuted, moved by half a "
       "meter along every axis, and rotated by a quarter turn about z, each against the oracle's answer to "
       "the changed problem.",
       "That answer's own tolerances; moved states are rounded to fp32 first, for both sides.",
       "What is wrong in the same way everywhere."},
      {"status",
       "Errors that are made on purpose, in the scene's domain, with few particles and no walls: one leaves "
       "through each face of each free axis, two at once, one after the other; positions and velocities "
       "that are no number or infinite, in each component. And none where there is none.",
       "Exact: each report has the right kind, particle and substep, and no other kind. A backend may refuse "
       "to load what is no finite number.",
       "Capacities and missed pairs, which nobody can provoke from outside."},
  };
  return checks;
}

CheckSelection all_checks() {
  CheckSelection all;
  for (const auto& check : check_descriptions()) all.insert(check.name);
  return all;
}

std::string check_of_row(const std::string& row) {
  if (std::ranges::find(rows_of_fields, row) != std::end(rows_of_fields)) return "fields";
  return all_checks().contains(row) ? row : "";
}

CheckSelection parse_checks(const std::vector<std::string>& names) {
  std::string known;
  for (const auto& check : check_descriptions()) known += (known.empty() ? "" : ", ") + std::string(check.name);
  CheckSelection chosen;
  for (const auto& name : names) {
    const std::string check = check_of_row(name);
    if (!check.empty() && check != name)
      throw InputError("command line", "--check", name, "a row of the check " + check + "; one of " + known);
    if (check.empty()) throw InputError("command line", "--check", name, "one of " + known);
    chosen.insert(name);
  }
  return chosen;
}

}  // namespace decant
