/// \file
/// What is said of a pour in the end.
#pragma once

#include "oracle/backend.hpp"
#include "reference/scene.hpp"
#include "tools/pour/pour.hpp"

#include <string>

namespace decant::pour {

/// The summary as JSON. \param out  the output folder
std::string result_json(const Result& result, const BackendInfo& info, const std::string& out);

/// The summary in lines, to standard output.
void print_result(const Result& result, const BackendInfo& info, const Scene& scene);

}  // namespace decant::pour
