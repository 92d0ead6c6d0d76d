/// \file
/// The pairs of backend and recording that `decant conform` was asked for, judged one after the other.
#pragma once

#include "oracle/checks/conform.hpp"
#include "tools/commands/interruptible.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace decant {

/// A backend that was asked for, or why it is not there.
struct Candidate {
  std::unique_ptr<Backend> backend;
  BackendInfo info;
  std::string why_not;
  bool device_absent = false;
};
/// Of choose_backend; one that is not there says why.
Candidate candidate_of(const std::string& name, const std::string& executor);

/// What is asked of them.
struct ConformRun {
  const std::vector<Fixture>& fixtures;
  CheckSelection checks;
  Backend* own = nullptr;  // the reference; null: ours
  int sample_every = 0;    // as of prepare_reference
  bool exit_first = false;
  bool quiet = false;
};

/// What has been judged so far.
struct Judged {
  Report report;
  std::int64_t pairs = 0;                               // whose rows are there
  std::vector<std::pair<double, std::string>> seconds;  // without the reference; by name
};

/// Adds the rows of all, pair by pair, until one fails where that is asked for.
void check_all(std::vector<Candidate>& candidates, const ConformRun& run, Interruptible& work, Judged& judged);

/// What was asked for and is not there is in the report too.
void add_what_was_not_judged(const std::vector<Candidate>& candidates, const std::vector<Fixture>& fixtures,
                             const std::string& why, Judged& judged);

/// The slowest pairs of backend and fixture, one per line.
std::string slowest(std::vector<std::pair<double, std::string>> seconds, int most);

}  // namespace decant
