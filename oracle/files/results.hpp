/// \file
/// Results computed elsewhere, in any language, judged without linking: of one of our fixtures, or
/// of states with a reference of their own (named_fields.hpp). The files' layout is in
/// formats/results.md.
#pragma once

#include "oracle/checks/conform.hpp"
#include "oracle/checks/field_checks.hpp"
#include "oracle/files/matching.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace decant {

/// Schema version of results files; a reader refuses any other.
inline constexpr std::int64_t results_schema = 1;

/// Rows of what was given, and of what was not (each not_run, with its reason). What was not given
/// was not asked about, so it makes no verdict better or worse.
struct CheckedResults {
  std::vector<CheckRow> given, absent;
  std::int64_t states = 1;                  // of the reference
  std::vector<std::string> missing_states;  // of them, in the results

  void add(std::vector<CheckRow> rows);
};

/// What a results file holds about a fixture; values in id order, members that were not given stay
/// unwritten.
struct Results {
  std::string device;
  Answered own, staged, after;  // names of what was given
  Fields own_fields, staged_fields;
  ParticleState after_state;
  bool has_ids = false;
  Matching ids;
};

/// Row `ids`: how many are missing, doubled or of no particle. \param expected  their number
void check_ids(const Matching& ids, Eigen::Index expected, RowBuilder& builder);

/// The checks that a results file can answer: fields, substep, conservation.
const CheckSelection& results_checks();

/// Throws InputError naming file, dataset and what is wrong: another fixture, another shape or
/// type, a name that is not of a field, another unit. A NaN is an answer, and fails its check.
Results read_results(const std::filesystem::path& file, const Fixture& fixture);

/// Each field that was given, by the tolerance that a backend's has.
/// \param name  stands as the rows' backend, "file" as their executor
/// \param oracle  prepared for these checks at least; \param checks  of results_checks()
CheckedResults run_checks(const Results& results, const std::string& name, const Fixture& fixture,
                          const PreparedReference& oracle, const CheckSelection& checks);

}  // namespace decant
