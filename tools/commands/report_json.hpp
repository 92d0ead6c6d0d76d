/// \file
/// A report as JSON, for programs that read what `decant conform` prints.
#pragma once

#include "oracle/report/report.hpp"
#include "tools/commands/reproducers.hpp"

#include <string>
#include <vector>

namespace decant {

/// \param line  the verdict's; \param status  the exit status
std::string json_text(const Report& report, const std::vector<ReproducerFile>& reproducers, const std::string& line,
                      int status);

}  // namespace decant
