/// \file
/// What a GPU's counters say of each kernel of a backend: Nsight Compute (ncu) runs this command once more on a
/// recorded state, and what it counted is told per kernel. Plug-ins are seen as well, because ncu follows processes.
#pragma once

#include "reference/error.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace decant::profile {

/// One figure per kernel launch: a metric of ncu, perhaps less another, over another, times a scale.
struct Counter {
  const char* name;    // in JSON and in files
  const char* metric;  // of ncu
  const char* less;    // null, or what is subtracted from it
  const char* over;    // null, or what it is divided by
  double scale;
  const char* unit;
  const char* heading;  // of the table's column; null: in JSON only
};
extern const std::array<Counter, 26> counters;

/// Reasons why warps wait, ncu's names; each in JSON as stall_NAME, mean number of waiting warps per issued instruction.
extern const std::array<const char*, 11> stalls;

struct Kernel {
  std::string name;
  std::vector<double> values;  // of counters, then of stalls; NaN where ncu had none
  /// The largest of the stalls, "long_scoreboard 3.2".
  std::string largest_stall() const;
};

/// Substeps that are run, call by call: one that builds whatever is built, one more.
inline constexpr int calls[] = {1, 1};

/// The last launch of each kernel in ncu's raw CSV, in the order of first launches. Throws BackendError where it is
/// none.
std::vector<Kernel> kernels_in(const std::string& csv);

/// Runs ncu (DECANT_NCU, or ncu on the PATH) on this command, which advances the recording by the backend. Throws
/// BackendError with what ncu said where it is not there or may not count.
/// \param choice  as --backend takes it \param executor  likewise
std::vector<Kernel> of_backend(const std::string& fixture, const std::string& choice, const std::string& executor);

/// A table for the terminal, one line per kernel.
std::string table(const std::vector<Kernel>& kernels);

/// One run as a JSON object: fixture, backend, kernels with all counters.
std::string json(const std::string& fixture, const std::string& choice, const std::vector<Kernel>& kernels);

}  // namespace decant::profile
