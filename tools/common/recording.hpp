/// \file
/// What every program that writes a fixture does: the oracle's answer, its ensemble.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/solution/fixture.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace decant {

/// Rounds the fixture's state to fp32, evaluates fields and condition sums there, and runs its
/// ensemble. Returns why no backend can pass on that state, for people to read; empty for a sound
/// one.
std::string record_answer(Fixture& fixture, std::int64_t ensemble_substeps, std::int64_t ensemble_members);

/// That of this program, where the state started from, and the backend that moved it on.
std::map<std::string, std::string> recording_provenance(const BackendInfo& info, const std::string& started_from);

/// The recording's state in the same scene with another kernel, answered anew; itself where it has that kernel. Throws
/// InputError where no backend could pass on it.
/// \param kernel  one of kernel_names
Fixture with_kernel(Fixture fixture, KernelFamily kernel);

}  // namespace decant
