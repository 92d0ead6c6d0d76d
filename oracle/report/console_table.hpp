/// \file
/// Reports as text of at most 100 columns.
#pragma once

#include "oracle/report/report.hpp"

#include <cstddef>
#include <string>

namespace decant {

/// Table of backend × fixture: verdict, worst score, the check it came from; then every row that
/// did not pass with field, particle, error and tolerance; last one line for the whole. Plain text,
/// at most 100 columns.
std::string console_table(const Report& report);

/// Backend, its options and its executor as tables name them: "hash(sort=thrust) cuda".
std::string backend_label(const CheckRow& row);

/// "substep / velocity"; the check alone where the field has its name.
std::string check_label(const CheckRow& row);

/// One row as the table tells it below itself: verdict, place, figures, reason; several lines.
std::string in_full(const CheckRow& row);

/// Text broken at spaces, every line after the indent, none wider than the table.
std::string wrapped(const std::string& text, std::size_t indent);

/// The last line of the table: "6 fixtures × 1 backend: pass".
std::string verdict_line(const Report& report);

}  // namespace decant
