/// \file
/// Faults that were written without knowledge of the checks (heldout.py): none is named by a check, so
/// any failure of a conformance run counts.
#pragma once

#include "gpu/backends.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace decant {

/// Runs each fault through what `decant conform` runs, the backends at their defaults on every small
/// recording of `folder`, and then through the options that the fault needs, if it names any, until
/// something fails. A fault marked `equivalent` must not be caught. Returns a table and a count.
/// \param only  names; empty: all
std::string check_held_out(const nlohmann::json& faults, Executor executor, int jobs,
                           const std::filesystem::path& folder, const std::vector<std::string>& only, bool& all_caught);

}  // namespace decant
