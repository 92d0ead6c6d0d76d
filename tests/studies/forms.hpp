/// \file
/// The study `forms`: whether any legal way to evaluate the fields in fp32 exceeds a tolerance.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace decant {

/// Lines of one problem, "K" counting fixtures first and random cases after them: for every set of forms
/// and every field "problem forms… field score".
/// \param tries  sets of forms per problem
std::string lines_of_forms(const std::vector<std::string>& fixtures, std::uint32_t k, std::uint32_t first, int tries);

/// The table of these lines, and how many scores are above 1.
struct FormsTable {
  std::string text;
  std::int64_t problems = 0, above = 0;
};
FormsTable table_of_forms(const std::vector<std::string>& lines);

}  // namespace decant
