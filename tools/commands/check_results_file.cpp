/// \file
/// From files on the command line to rows, and how they read in a terminal.
#include "tools/commands/check_results_file.hpp"

#include "oracle/files/fixture_file.hpp"
#include "oracle/files/named_fields.hpp"
#include "oracle/files/results.hpp"
#include "oracle/report/console_table.hpp"
#include "oracle/solution/digest.hpp"
#include "reference/error.hpp"
#include "tools/common/build_provenance.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>

namespace decant {
namespace {

CheckSelection checks_of(const ResultsRequest& request) {
  if (request.checks.empty()) return results_checks();
  const CheckSelection checks = parse_checks(request.checks);
  for (const auto& check : checks)
    if (!results_checks().count(check))
      throw InputError("command line", "--check", check,
                       "fields, substep or conservation with --results; the others run a solver");
  return checks;
}

CheckedResults check_on_fixture(const ResultsRequest& request, const std::string& name, ResultsOutcome& outcome) {
  if (request.fixtures.size() != 1)
    throw InputError("command line", "FIXTURE", fmt::format("{} of them", request.fixtures.size()),
                     "the one that --results was computed from (or --oracle)");
  const CheckSelection checks = checks_of(request);
  const Fixture& fixture = outcome.fixtures.emplace_back(read_fixture(request.fixtures.front()));
  const Results results = read_results(request.results, fixture);
  outcome.report.provenance["fixture_sha256." + fixture.name] = fixture.sha256;
  const auto oracle =
      std::make_unique<const PreparedReference>(prepare_reference(fixture, checks, 0, Staged::as_computed));
  return run_checks(results, name, fixture, *oracle, checks);
}

CheckedResults check_on_oracle(const ResultsRequest& request, const std::string& name, Report& report) {
  if (!request.fixtures.empty())
    throw InputError("command line", "FIXTURE", request.fixtures.front(), "either FIXTURE or --oracle");
  if (!request.checks.empty())
    throw InputError("command line", "--check", request.checks.front(),
                     "none with --oracle: their fields are one check");
  report.provenance["oracle_sha256"] = sha256_of_file(request.oracle);
  return check_named_fields(request.oracle, request.results, name);
}

std::string place_of(const CheckRow& row) { return row.check == row.field ? row.check : row.check + " / " + row.field; }

/// The table of what was given, then the names of what was not.
std::string table_of(const Report& given, const std::vector<CheckRow>& absent, const std::string& line) {
  std::string table = console_table(given);
  table.resize(table.size() - verdict_line(given).size() - 1);
  std::string names;
  for (const CheckRow& row : absent) names += fmt::format("{}{}", names.empty() ? "" : ", ", place_of(row));
  if (!absent.empty()) table += wrapped("not_run, not given: " + names, 0) + "\n";
  return table + line + "\n";
}

}  // namespace

ResultsOutcome check_results_file(const ResultsRequest& request) {
  const std::filesystem::path file(request.results);
  const std::string name = request.name.empty() ? file.stem().string() : request.name;
  ResultsOutcome outcome;
  outcome.report.provenance = build_provenance();
  CheckedResults judged = request.oracle.empty() ? check_on_fixture(request, name, outcome)
                                                 : check_on_oracle(request, name, outcome.report);
  outcome.report.provenance["results_sha256"] = sha256_of_file(file);

  Report given;
  std::int64_t rows = 0;
  for (CheckRow& row : judged.given) {
    if (row.check != "ids") ++rows;
    outcome.report.provenance["device." + name] = "file: " + row.device;
    condense(row);
    given.rows.push_back(std::move(row));
  }
  outcome.status = rows == 0 ? 3 : exit_status(given);
  outcome.line = fmt::format("{}; {} rows given, {} not given and not_run", verdict_line(rows == 0 ? Report{} : given),
                             rows, judged.absent.size());
  if (!judged.missing_states.empty())
    outcome.line += fmt::format("; {} of {} states missing: {}", judged.missing_states.size(), judged.states,
                                fmt::join(judged.missing_states, ", "));
  outcome.table = table_of(given, judged.absent, outcome.line);
  outcome.report.rows = std::move(given.rows);
  for (CheckRow& row : judged.absent) outcome.report.rows.push_back(std::move(row));
  return outcome;
}

}  // namespace decant
