/// \file
/// Planted faults found by fuzzing alone.
#pragma once

#include "gpu/backends.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>

namespace decant {

/// Fuzzes each fault from the same first seed until a property fails, in a process of its own, and minimises
/// what was found. Returns the table; `all_found` tells the rest.
std::string fuzz_faults(const nlohmann::json& faults, Executor executor, int jobs, std::int64_t most_cases,
                        std::uint64_t first_seed, bool& all_found);

}  // namespace decant
