/// \file
/// Pairs of rows, and how a person reads them.
#include "oracle/report/report_diff.hpp"

#include "oracle/report/console_table.hpp"
#include "reference/error.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace decant {
namespace {

// Lines of one kind in the text; all are in the diff.
constexpr std::size_t most_lines = 20;

/// What makes a row the same in both; `repeat` counts rows of one report that are alike.
using Key = std::tuple<std::string, std::string, std::string, std::string, std::string, std::string, int>;

/// Rows by key, and their keys in the report's order.
struct Keyed {
  std::map<Key, const CheckRow*> rows;
  std::vector<Key> order;

  explicit Keyed(const Report& report) {
    for (const CheckRow& row : report.rows) {
      Key key{row.backend, row.options, row.executor, row.fixture, row.check, row.field, 0};
      while (!rows.emplace(key, &row).second) ++std::get<6>(key);
      order.push_back(key);
    }
  }
};

int badness(const CheckRow& row) {
  const Verdict verdict = verdict_of(row);
  return verdict == Verdict::pass ? 0 : verdict == Verdict::not_run ? 1 : 2;
}

/// log2 of how much a score grew; infinite from or to 0 or what is no number; 0 where it stayed.
double growth(const RowPair& pair) {
  const double a = pair.before.score, b = pair.after.score;
  if (a == b || (std::isnan(a) && std::isnan(b))) return 0;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (std::isnan(b)) return infinity;
  if (std::isnan(a)) return -infinity;
  return std::log2(b) - std::log2(a);
}

void compare_provenance(const Report& before, const Report& after, ReportDiff& diff) {
  const auto value = [](const Report& report, const std::string& key) {
    const auto found = report.provenance.find(key);
    return found == report.provenance.end() ? std::string() : found->second;
  };
  for (const Report* report : {&before, &after})
    for (const auto& [key, text] : report->provenance)
      if (value(before, key) != value(after, key)) diff.provenance[key] = {value(before, key), value(after, key)};
}

std::string place_of(const CheckRow& row) {
  return fmt::format("{} on {}: {}", backend_label(row), row.fixture, check_label(row));
}

/// Rows that one report lacks, a line a backend and fixture.
std::string missing_text(const char* title, const std::vector<CheckRow>& rows) {
  std::map<std::pair<std::string, std::string>, std::vector<const CheckRow*>> groups;
  for (const CheckRow& row : rows) groups[{backend_label(row), row.fixture}].push_back(&row);
  std::string text;
  for (const auto& [name, group] : groups) {
    const auto passing = std::count_if(group.begin(), group.end(),
                                       [](const CheckRow* row) { return verdict_of(*row) == Verdict::pass; });
    std::string line = fmt::format("{}: {} on {}: {} row{}, {} passing", title, name.first, name.second, group.size(),
                                   group.size() == 1 ? "" : "s", passing);
    if (group.size() <= 4)
      for (const CheckRow* row : group) line += fmt::format("; {} {}", check_label(*row), to_string(verdict_of(*row)));
    text += wrapped(line, 0);
  }
  return text;
}

std::string verdicts_text(const char* title, const std::vector<RowPair>& pairs) {
  std::string text;
  for (const auto& [before, after] : pairs) {
    text += wrapped(fmt::format("{}: {} -> {}, score {:.3g} -> {:.3g}: {}", title, to_string(verdict_of(before)),
                                to_string(verdict_of(after)), before.score, after.score, place_of(after)),
                    0);
    const std::string all = in_full(after);
    if (verdict_of(after) != Verdict::pass) text += all.substr(all.find("\n    ") + 1);
  }
  return text;
}

std::string scores_text(const char* title, const std::vector<RowPair>& pairs) {
  std::string text;
  for (std::size_t k = 0; k < std::min(pairs.size(), most_lines); ++k) {
    const auto& [before, after] = pairs[k];
    const double times = std::exp2(std::abs(growth(pairs[k])));
    text += wrapped(fmt::format("{}: score {:.3g} -> {:.3g} ({:.3g} times): {}", title, before.score, after.score,
                                times, place_of(after)),
                    0);
  }
  if (pairs.size() > most_lines) text += fmt::format("{}: {} more\n", title, pairs.size() - most_lines);
  return text;
}

}  // namespace

bool ReportDiff::got_worse() const {
  return !worse.empty() || std::any_of(only_before.begin(), only_before.end(),
                                       [](const auto& row) { return verdict_of(row) == Verdict::pass; });
}

ReportDiff difference(const Report& before, const Report& after, double factor) {
  const Keyed old_rows(before), new_rows(after);
  ReportDiff diff;
  diff.factor = factor;
  for (const Key& key : old_rows.order) {
    const CheckRow& old_row = *old_rows.rows.at(key);
    const auto found = new_rows.rows.find(key);
    if (found == new_rows.rows.end()) {
      diff.only_before.push_back(old_row);
      continue;
    }
    ++diff.compared;
    RowPair pair{old_row, *found->second};
    const int step = badness(pair.after) - badness(pair.before);
    const double grown = growth(pair);
    if (step != 0) (step > 0 ? diff.worse : diff.better).push_back(std::move(pair));
    else if (std::abs(grown) > std::log2(factor)) (grown > 0 ? diff.grown : diff.shrunk).push_back(std::move(pair));
  }
  for (const Key& key : new_rows.order)
    if (!old_rows.rows.count(key)) diff.only_after.push_back(*new_rows.rows.at(key));
  for (auto* moved : {&diff.grown, &diff.shrunk})
    std::stable_sort(moved->begin(), moved->end(),
                     [](const RowPair& a, const RowPair& b) { return std::abs(growth(a)) > std::abs(growth(b)); });
  compare_provenance(before, after, diff);
  return diff;
}

void pair_backends(Report& before, Report& after, const std::string& from, const std::string& to) {
  const auto rename = [&](Report& report, const std::string& name) {
    bool any = false;
    for (CheckRow& row : report.rows) {
      if (row.backend != name && backend_label(row) != name) continue;
      any = true;
      row.backend = fmt::format("{} = {}", from, to);
      row.options.clear();
      row.executor.clear();
    }
    if (!any)
      throw InputError(
          "command line", "--pair", from + "=" + to,
          fmt::format("names of backends; there is no {} among {}", name, fmt::join(backends_of(report), ", ")));
  };
  rename(before, from);
  rename(after, to);
}

std::vector<std::string> backends_of(const Report& report) {
  std::vector<std::string> names;
  for (const CheckRow& row : report.rows)
    if (std::find(names.begin(), names.end(), backend_label(row)) == names.end()) names.push_back(backend_label(row));
  return names;
}

std::string diff_text(const ReportDiff& diff) {
  std::string text = verdicts_text("worse", diff.worse) + verdicts_text("better", diff.better) +
                     missing_text("only before", diff.only_before) + missing_text("only after", diff.only_after) +
                     scores_text("grown", diff.grown) + scores_text("shrunk", diff.shrunk);
  for (const auto& [key, values] : diff.provenance)
    text += wrapped(fmt::format("{}: {} -> {}", key, values.first.empty() ? "-" : values.first,
                                values.second.empty() ? "-" : values.second),
                    0);
  return text + (text.empty() ? "" : "\n") + diff_line(diff) + "\n";
}

std::string diff_line(const ReportDiff& diff) {
  std::string changes;
  const auto tell = [&](std::size_t count, const std::string& what) {
    if (count > 0) changes += fmt::format("{}{} {}", changes.empty() ? "" : ", ", count, what);
  };
  tell(diff.worse.size(), "worse");
  tell(diff.better.size(), "better");
  tell(diff.only_before.size(), "only before");
  tell(diff.only_after.size(), "only after");
  tell(diff.grown.size() + diff.shrunk.size(), fmt::format("moved more than {:g} times", diff.factor));
  return fmt::format("{} rows in both: {}: {}", diff.compared, changes.empty() ? "nothing moved" : changes,
                     diff.got_worse() ? "worse" : "no worse");
}

}  // namespace decant
