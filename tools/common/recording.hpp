/// \file
/// What every program that writes a fixture does: the oracle's answer, its ensemble.
#pragma once

#include "oracle/solution/fixture.hpp"

#include <cstdint>
#include <string>

namespace decant {

/// Rounds the fixture's state to fp32, evaluates fields and condition sums there, and runs its
/// ensemble. Returns why no backend can pass on that state, for people to read; empty for a sound
/// one.
std::string record_answer(Fixture& fixture, std::int64_t ensemble_substeps, std::int64_t ensemble_members);

}  // namespace decant
