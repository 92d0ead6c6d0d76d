/// \file
/// Everything that a solver in another language needs to compute a fixture's fields: the state, the
/// constants, the walls as they stand and move, and the inputs of the staged accelerations. The
/// file's layout is in formats/results.md.
#pragma once

#include "oracle/checks/conform.hpp"

#include <filesystem>

namespace decant {

/// Schema version of inputs files.
inline constexpr std::int64_t inputs_schema = 1;

/// Throws std::runtime_error naming the file where writing fails.
/// \param oracle  prepared for any checks
void write_port_inputs(const std::filesystem::path& file, const Fixture& fixture, const PreparedReference& oracle);

}  // namespace decant
