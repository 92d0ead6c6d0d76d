/// \file
/// `decant diff`: what changed from one report to another, or where two pours part.
#include "oracle/files/report_file.hpp"
#include "oracle/report/report_diff.hpp"
#include "reference/error.hpp"
#include "tools/commands/commands.hpp"
#include "tools/pour/pour_diff.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace decant {
namespace {

struct DiffArguments {
  std::string before, after;
  std::vector<std::string> spread, pairs;
  double factor = 0;  // 0: the kind's own
  bool json = false, quiet = false;
};

constexpr const char* diff_footer =
    "Two reports: rows are the same where backend, options, executor, fixture, check and field are.\n"
    "Two pours of one scene (folders, or their frames.h5): distances frame by frame, positions in dx.\n"
    "Fluid is chaotic, so that right answers part too: further pours from perturbed starts\n"
    "(`decant pour --perturb SEED`), given with --spread, say how far. A frame is within the spread where\n"
    "every distance but that of energies is at most --factor times the largest between pours of the\n"
    "spread until then.\n"
    "Exit status: 0 nothing got worse, or the same bits, or within the spread; 1 a verdict got worse or a\n"
    "row that passed is gone, or the pours differ (beyond the spread where one is given); 2 bad input.\n"
    "\n"
    "Examples:\n"
    "  decant diff fixtures/results/h200/conformance.h5 build/reports/conformance.h5\n"
    "  decant diff before.h5 after.h5 --pair hash=mine\n"
    "  decant diff pour-hash pour-list --spread pour-1 pour-2";

nlohmann::ordered_json named(const CheckRow& row) {
  return {{"backend", row.backend}, {"options", row.options}, {"executor", row.executor},
          {"fixture", row.fixture}, {"check", row.check},     {"field", row.field}};
}

nlohmann::ordered_json figures(const CheckRow& row) {
  return {{"verdict", to_string(verdict_of(row))},
          {"score", row.score},
          {"error", row.error},
          {"tolerance", row.tolerance},
          {"worst_id", row.worst_id},
          {"reason", reason_of(row)}};
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

int diff_pours(const DiffArguments& arguments) {
  if (!arguments.pairs.empty())
    throw InputError("command line", "--pair", arguments.pairs[0], "two reports: it pairs their backends");
  const pour::Difference found =
      pour::difference(arguments.before, arguments.after, {arguments.spread.begin(), arguments.spread.end()},
                       arguments.factor > 0 ? arguments.factor : pour::Difference{}.factor);
  const int status = found.within() ? exit_pass : exit_does_not_conform;
  if (arguments.json) fmt::print("{}\n", pour::difference_json(found, status));
  else if (arguments.quiet) fmt::print("{}\n", pour::difference_line(found));
  else fmt::print("{}", pour::difference_text(found));
  return status;
}

int diff_reports(const DiffArguments& arguments) {
  if (!arguments.spread.empty())
    throw InputError("command line", "--spread", arguments.spread[0], "two pours: reports have no spread");
  Report before = read_report(arguments.before), after = read_report(arguments.after);
  for (const std::string& pair : arguments.pairs) {
    const auto equals = pair.find('=');
    if (equals == std::string::npos)
      throw InputError("command line", "--pair", pair, "BEFORE=AFTER, names of backends");
    pair_backends(before, after, pair.substr(0, equals), pair.substr(equals + 1));
  }
  const ReportDiff found = difference(before, after, arguments.factor > 0 ? arguments.factor : 2);
  if (found.compared == 0 && !before.rows.empty() && !after.rows.empty()) {
    const auto old_names = backends_of(before), new_names = backends_of(after);
    const bool shared = std::any_of(old_names.begin(), old_names.end(), [&](const auto& name) {
      return std::find(new_names.begin(), new_names.end(), name) != new_names.end();
    });
    if (!shared)
      throw InputError(
          arguments.after, "backends", fmt::format("{}", fmt::join(new_names, ", ")),
          fmt::format("those of {} ({}), or --pair \"{}={}\" to compare one with another", arguments.before,
                      fmt::join(old_names, ", "), before.rows[0].backend, after.rows[0].backend));
  }
  const int status = found.got_worse() ? exit_does_not_conform : exit_pass;
  if (arguments.json) fmt::print("{}\n", json_text(found, status));
  else if (arguments.quiet) fmt::print("{}\n", diff_line(found));
  else fmt::print("{}", diff_text(found));
  return status;
}

/// What the two are is seen from what they hold.
int diff(const DiffArguments& arguments) {
  for (const std::string& path : {arguments.before, arguments.after})
    if (std::error_code ignored; !std::filesystem::exists(path, ignored))
      throw InputError(path, "file", "not found", "a report (*.h5) or a pour's folder");
  const bool before = pour::is_pour(arguments.before), after = pour::is_pour(arguments.after);
  if (before != after)
    throw InputError(before ? arguments.after : arguments.before, "kind", "no pour",
                     fmt::format("a pour, as {} is; or two reports", before ? arguments.before : arguments.after));
  return before ? diff_pours(arguments) : diff_reports(arguments);
}

}  // namespace

void add_diff_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<DiffArguments>();
  CLI::App* verb = app.add_subcommand("diff", "tell two reports, or two pours, apart");
  verb->footer(diff_footer);
  verb->add_option("BEFORE", arguments->before, "report (*.h5), or a pour's folder")->required();
  verb->add_option("AFTER", arguments->after, "another of the same kind")->required();
  verb->add_option("--spread", arguments->spread, "pours: more of them, from perturbed starts");
  verb->add_option("--pair", arguments->pairs, "reports: BEFORE=AFTER, backends of different names to compare");
  verb->add_option("--factor", arguments->factor,
                   "reports: scores that moved by more are told (default 2);\n"
                   "pours: how many times the spread is still within it (default 3)")
      ->check(CLI::Range(1.0, 1e300));
  verb->add_flag("--json", arguments->json, "all of it as JSON");
  verb->add_flag("--quiet", arguments->quiet, "the last line alone");
  verb->callback([arguments, &exit_status] { exit_status = diff(*arguments); });
}

}  // namespace decant
