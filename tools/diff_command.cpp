/// \file
/// `decant diff`: what changed from one report to another.
#include "oracle/report_diff.hpp"
#include "tools/commands.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>
#include <vector>

namespace decant {
namespace {

struct DiffArguments {
  std::string before, after;
  double factor = 2;
  bool json = false, quiet = false;
};

constexpr const char* footer =
    "Rows are the same where backend, options, executor, fixture, check and field are.\n"
    "Exit status: 0 nothing got worse, 1 a verdict did or a row that passed is gone, 2 bad input.\n"
    "\n"
    "Example:\n"
    "  decant diff fixtures/results/h200/conformance.h5 build/reports/conformance.h5";

nlohmann::ordered_json named(const CheckRow& row) {
  return {{"backend", row.backend}, {"options", row.options}, {"executor", row.executor},
          {"fixture", row.fixture}, {"check", row.check},     {"field", row.field}};
}

nlohmann::ordered_json figures(const CheckRow& row) {
  return {{"verdict", to_string(judged_verdict(row))},
          {"score", row.score},
          {"value", row.value},
          {"tolerance", row.tolerance},
          {"worst_id", row.worst_id},
          {"reason", judged_reason(row)}};
}

nlohmann::ordered_json pairs_json(const std::vector<RowPair>& pairs) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [before, after] : pairs) {
    auto entry = named(after);
    entry["before"] = figures(before);
    entry["after"] = figures(after);
    list.push_back(std::move(entry));
  }
  return list;
}

nlohmann::ordered_json rows_json(const std::vector<CheckRow>& rows) {
  auto list = nlohmann::ordered_json::array();
  for (const CheckRow& row : rows) {
    auto entry = named(row);
    entry.update(figures(row));
    list.push_back(std::move(entry));
  }
  return list;
}

std::string json_text(const ReportDiff& diff, int status) {
  auto provenance = nlohmann::ordered_json::object();
  for (const auto& [key, values] : diff.provenance)
    provenance[key] = {{"before", values.first}, {"after", values.second}};
  const nlohmann::ordered_json all = {{"summary", diff_line(diff)},
                                      {"exit_status", status},
                                      {"compared", diff.compared},
                                      {"factor", diff.factor},
                                      {"worse", pairs_json(diff.worse)},
                                      {"better", pairs_json(diff.better)},
                                      {"only_before", rows_json(diff.only_before)},
                                      {"only_after", rows_json(diff.only_after)},
                                      {"grown", pairs_json(diff.grown)},
                                      {"shrunk", pairs_json(diff.shrunk)},
                                      {"provenance", provenance}};
  return all.dump(2);
}

int diff(const DiffArguments& arguments) {
  const ReportDiff found =
      difference(read_report(arguments.before), read_report(arguments.after), arguments.factor);
  const int status = found.got_worse() ? exit_does_not_conform : exit_pass;
  if (arguments.json)
    fmt::print("{}\n", json_text(found, status));
  else if (arguments.quiet)
    fmt::print("{}\n", diff_line(found));
  else
    fmt::print("{}", diff_text(found));
  return status;
}

}  // namespace

void add_diff_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<DiffArguments>();
  CLI::App* verb = app.add_subcommand("diff", "tell two reports apart");
  verb->footer(footer);
  verb->add_option("BEFORE", arguments->before, "report (*.h5)")->required();
  verb->add_option("AFTER", arguments->after, "report (*.h5)")->required();
  verb->add_option("--factor", arguments->factor, "scores that moved by more are told")
      ->check(CLI::Range(1.0, 1e300))
      ->capture_default_str();
  verb->add_flag("--json", arguments->json, "all of it as JSON");
  verb->add_flag("--quiet", arguments->quiet, "the last line alone");
  verb->callback([arguments, &exit_status] { exit_status = diff(*arguments); });
}

}  // namespace decant
