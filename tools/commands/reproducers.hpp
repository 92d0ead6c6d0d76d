/// \file
/// Where a backend failed, as small fixtures to judge it on again: the fluid around one failing
/// particle, answered by the oracle anew.
#pragma once

#include "oracle/report/report.hpp"
#include "oracle/solution/fixture.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace decant {

/// How far the fluid is kept, in H: accelerations need the particle's neighbors' neighbors, the
/// rest is margin.
inline constexpr double reproducer_radius = 3;

/// A file to be written for one row.
struct ReproducerFile {
  std::size_t row = 0;  // in the report
  std::filesystem::path file;
};

/// One file a backend and fixture that fail somewhere, FIXTURE-BACKEND-CHECK-FIELD-ID.h5 in the
/// folder, of the first failing row with a fluid particle; where there is none, of the first with a
/// wall particle that has fluid near. What failed at no particle has no file.
std::vector<ReproducerFile> reproducers_of(const Report& report, const std::filesystem::path& folder);

/// Writes one (fixture.hpp); the provenance says what it was cut out of and why. Returns a line
/// about it, and in `warning` why no backend can pass on it, where that is so. Throws
/// std::runtime_error naming the file.
std::string write_reproducer(const std::filesystem::path& file, const Fixture& fixture, const CheckRow& row,
                             std::string& warning);

}  // namespace decant
