/// \file
/// `decant conform --results`: judges a file instead of a backend.
#pragma once

#include "oracle/checks/checks.hpp"
#include "oracle/report/report.hpp"
#include "oracle/solution/fixture.hpp"

#include <string>
#include <vector>

namespace decant {

struct ResultsRequest {
  std::string results;                // the file that is judged
  std::vector<std::string> fixtures;  // exactly one, unless there is an oracle
  std::string oracle;                 // their own reference; empty: ours
  std::string name;                   // of the rows' backend; empty: the file's
  std::vector<std::string> checks;    // empty: all that a file can answer
};

struct ResultsOutcome {
  Report report;  // with a row not_run for each field that was not given
  /// 0 all that was given passes, 1 something fails, 3 something given has nothing to be judged by,
  /// or nothing was given. What was not given changes nothing here.
  int status = 0;
  std::string table;              // as console_table, of what was given; then what was not
  std::string line;               // the table's last
  std::vector<Fixture> fixtures;  // that rows are of; none with an oracle of their own
};

/// Throws InputError.
ResultsOutcome check_results_file(const ResultsRequest& request);

}  // namespace decant
