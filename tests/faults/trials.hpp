/// \file
/// One wrong backend judged on one recording, in a process of its own.
#pragma once

#include "oracle/checks/conform.hpp"
#include "tests/faults/processes.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace decant {

/// Switches a planted fault on, for both executors of this process; 0: none.
void choose_fault(Executor executor, int number);

struct Trial {
  int number = 0;  // 0: no fault
  std::string backend, fixture;
  CheckSelection checks = all_checks();
};

/// What one trial's process said before it ended.
struct Outcome {
  bool caught = false;  // by anything
  std::string ended;    // "", "crash", "hang"
  /// Largest score of the failing rows by check, infinite where there was nothing to compare.
  std::map<std::string, double> failed;
};

/// The fixtures' oracles, prepared before any process is split off.
struct Prepared {
  Fixture fixture;
  PreparedReference oracle;
};

/// What plant.py says of a fault. Throws where it says nothing under that key.
std::string text(const nlohmann::json& fault, const char* key);
int number(const nlohmann::json& fault);
/// Why nothing can show it; empty where something has to.
std::string why_equivalent(const nlohmann::json& fault);

/// Every fixture of the trials, read from `folder` and prepared for all checks.
std::map<std::string, Prepared> prepare_all(const std::vector<Trial>& trials, const std::filesystem::path& folder);

/// One outcome per trial, `jobs` processes at a time.
std::vector<Outcome> run_all(const std::vector<Trial>& trials, Executor executor, int jobs,
                             const std::map<std::string, Prepared>& prepared);

/// Every pair of backend and fixture once, without a fault.
std::vector<Trial> clean(const std::vector<Trial>& trials);

/// Trials of a backend without a fault, which must pass: "brute on hostile-exact-support fails …"; empty
/// where all do.
std::string failures_without_fault(const std::vector<Trial>& trials, Executor executor, int jobs,
                                   const std::map<std::string, Prepared>& prepared);

/// Names of the checks that failed, but for one.
std::string joined(const std::map<std::string, double>& failed, const std::string& but);

}  // namespace decant
