/// \file
/// What changed between two reports. Rows are the same where backend, options, executor, fixture,
/// check and field are.
#pragma once

#include "oracle/report/report.hpp"

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace decant {

/// One row as two reports have it.
struct RowPair {
  CheckRow before, after;
};

/// Two reports, apart.
struct ReportDiff {
  std::size_t compared = 0;            // rows that both have
  double factor = 2;                   // a score that moved by no more has not moved
  std::vector<RowPair> worse, better;  // verdicts that changed
  std::vector<CheckRow> only_before, only_after;
  /// Same verdict, scores apart by more than the factor: those that grew, then those that shrank,
  /// the farthest first.
  std::vector<RowPair> grown, shrunk;
  /// Before and after, by key; a key that one of them lacks is empty there.
  std::map<std::string, std::pair<std::string, std::string>> provenance;

  /// True where a verdict got worse (pass, then not_run, then fail) or a row that passed is gone.
  bool got_worse() const;
};

/// Compares verdicts as verdict_of reads them. A score that is 0 or no number on one side alone
/// has moved beyond any factor. \param factor  >= 1
ReportDiff difference(const Report& before, const Report& after, double factor = 2);

/// Rows of backend `from` in `before` and of `to` in `after` become rows of one backend, "from = to",
/// without options and executor, so that they are compared. A name is a backend's own or its label
/// (backend_label). Throws InputError where a report has no such rows.
void pair_backends(Report& before, Report& after, const std::string& from, const std::string& to);

/// The labels of a report's backends, each once, in its order.
std::vector<std::string> backends_of(const Report& report);

/// For a terminal, at most 100 columns: verdicts that changed, rows that one report lacks, scores
/// that moved, provenance; last one line for the whole.
std::string diff_text(const ReportDiff& diff);

/// That line: "120 rows in both: 2 worse, 1 better: worse".
std::string diff_line(const ReportDiff& diff);

}  // namespace decant
