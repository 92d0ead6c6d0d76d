/// \file
/// What is said of a pour in the end.
#pragma once

#include "oracle/backend.hpp"
#include "reference/scene.hpp"
#include "tools/pour/pour.hpp"

#include <string>

namespace decant {

/// The summary as JSON. \param out  the output folder
std::string pour_json(const PourResult& result, const BackendInfo& info, const std::string& out);

/// The summary in lines, to standard output.
void print_pour(const PourResult& result, const BackendInfo& info, const Scene& scene);

}  // namespace decant
