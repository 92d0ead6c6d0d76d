/// \file
/// One backend judged on one fixture, stage by stage: neighbors, boundary volume, density, pressure,
/// accelerations from the oracle's own inputs, accelerations end to end, one substep.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/fixture.hpp"
#include "oracle/report.hpp"
#include "oracle/substep_answer.hpp"
#include "oracle/tolerance.hpp"

#include <memory>
#include <string>
#include <vector>

namespace decant {

/// Everything the oracle has to say about one fixture. Made once, used for every backend.
struct Judgement {
  Walls walls;
  OracleAnswer own;     // every stage from the stage before
  StageInputs inputs;   // the oracle's density and pressure, rounded to fp32
  OracleAnswer given;   // accelerations from those inputs
  Fields own_float, given_float;  // the same source in sequential fp32
  SubstepAnswer substep;
};

/// Fields and condition sums at one state, as a fixture records them. Returns why no backend can
/// pass on that state, for people to read; empty for a sound one. A lattice has thousands of pairs
/// at one distance, and where that is H nearly, fp32 cannot tell who is a neighbor.
std::string evaluate_oracle(const Scene& scene, const ParticleState& state, Fields& fields,
                            ConditionSums& condition);

/// Evaluates the oracle on the fixture's state. Throws InputError where the recorded fields are not
/// what this build's reference gives within the tolerances scaled from 2⁻²⁴ to 2⁻⁵³.
Judgement prepare(const Fixture& fixture);

/// Loads the fixture into the backend and compares; a backend that throws or reports trouble gives
/// rows with verdict fail and the reason. The checks are, in this order:
///   neighbors, boundary_volume, density, pressure   as the backend computes them
///   acceleration    from the oracle's density and pressure
///   evaluation      from the backend's own
///   substep         position and velocity one substep on, walls and contact included
std::vector<CheckRow> judge(Backend& backend, const Fixture& fixture, const Judgement& oracle);

}  // namespace decant
