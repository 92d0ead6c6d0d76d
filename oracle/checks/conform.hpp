/// \file
/// One backend judged on one fixture by the checks of checks.hpp.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/checks/audit.hpp"
#include "oracle/checks/checks.hpp"
#include "oracle/checks/contact_check.hpp"
#include "oracle/checks/transformed.hpp"
#include "oracle/report/report.hpp"
#include "oracle/solution/ensemble.hpp"
#include "oracle/solution/fixture.hpp"
#include "oracle/solution/substep_solution.hpp"
#include "oracle/solution/tolerance.hpp"

#include <memory>
#include <string>
#include <vector>

namespace decant {

/// The oracle's answer to the same problem told otherwise.
struct TransformedSolution {
  TransformedProblem problem;
  Walls walls;
  ReferenceSolution solution;
};

/// A part of a run, after which its state is read.
struct Segment {
  int substeps = 0;
  bool viewed = false;  // fields are evaluated too (oracle/checks/advanced_check.hpp)
};

/// Which pressure goes with the density that is handed in: the oracle's, as inputs of a port that is not linked have it
/// (oracle/formats/results.md); or with ρ0 c0² 2⁻¹⁴ added, some hundred tolerances, so that a solver that hands back
/// what it was given, in place of what its equation of state makes of the density, is seen.
enum class Staged : std::uint8_t { as_computed, offset };

/// The density and pressure to be handed in.
StageInputs stage_inputs(const Scene& scene, const Fields& own, Staged staged);

/// Everything the oracle has to say about one fixture. Made once, used for every backend.
struct PreparedReference {
  std::uint32_t offers = Offer::all;  // what of the below a reference has that is not ours (measured_reference.hpp)
  Walls walls;
  WallSolution volumes;
  ReferenceSolution own;        // every stage from the stage before
  StageInputs inputs;           // the oracle's density and pressure, rounded to fp32; see Staged
  ReferenceSolution given;      // accelerations from those inputs
  Fields own_fp32, given_fp32;  // the same source in sequential fp32
  SubstepSolution substep;
  std::vector<ContactProblem> contact;
  // The oracle's own run, as long as the fixture's ensemble is, and looked at as backends' runs are.
  std::vector<Segment> segments;
  std::size_t repeated = 0;  // so many of them, a quarter of the run or more, show that it is reproducible
  ParticleState later;
  AuditResult later_sample;
  double deepest = 0;  // m, inside a wall, at any look
  std::int64_t crossed = 0;
  std::vector<TransformedSolution> transformed;
};

/// Fields and condition sums at one state, as a fixture records them. Returns why no backend can
/// pass on that state, for people to read; empty for a sound one. A lattice has thousands of pairs
/// at one distance, and where that is H nearly, fp32 cannot tell who is a neighbor.
std::string evaluate_oracle(const Scene& scene, const ParticleState& state, Fields& fields, ConditionSums& condition);

/// Why no backend can pass where this is the answer; empty for a sound one.
std::string ill_posed_reason(const ReferenceSolution& solution);

/// Evaluates the oracle on the fixture's state, as far as these checks need it. Throws InputError where
/// the recorded fields, if there are any, are not what this build's reference gives within the tolerances scaled from 2⁻²⁴
/// to 2⁻⁵³.
/// \param sample_every  substeps between two samples of a run, for containment and mass; 0: where it is viewed,
///                    after half of the rest, and so on
PreparedReference prepare_reference(const Fixture& fixture, const CheckSelection& checks = all_checks(),
                                    int sample_every = 0, Staged staged = Staged::offset);

/// Loads the fixture into the backend and compares; a backend that throws or reports trouble gives
/// rows with verdict fail and the reason: one of the check `run`, and one of every check that was not made.
/// Rows of the check `fields` carry the stage's name:
///   neighbors, boundary_volume, density, pressure   as the backend computes them
///   equation_of_state, acceleration   from the oracle's density, and pressure
///   evaluation                        from the backend's own
/// \param oracle  prepared for these checks at least
std::vector<CheckRow> run_checks(Backend& backend, const Fixture& fixture, const PreparedReference& oracle,
                                 const CheckSelection& checks = all_checks());

}  // namespace decant
