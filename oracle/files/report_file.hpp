/// \file
/// Reports as files; the layout is in formats/report.md.
#pragma once

#include "oracle/report/report.hpp"

#include <cstdint>
#include <filesystem>

namespace decant {

/// Schema version of report files that are written; 2 is read as well.
inline constexpr std::int64_t report_schema = 3;

/// Writes the report whole or not at all, below 15 MB: once failing checks have filled 8 MB, later
/// ones keep their worst values, and then their quantiles alone. ParaView opens it where it has
/// neighborhood. Throws std::runtime_error naming the file where writing fails.
void write_report(const std::filesystem::path& file, const Report& report);

/// Rows and provenance of a report, without arrays and neighborhood. Throws InputError naming file and
/// dataset.
Report read_report(const std::filesystem::path& file);

}  // namespace decant
