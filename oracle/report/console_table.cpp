/// \file
/// The report as a person reads it in a terminal.
#include "oracle/report/console_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace decant {
namespace {

constexpr std::size_t widest = 100;  // columns

/// One backend on one fixture, over all its rows.
struct Line {
  std::string backend, fixture;
  Verdict verdict = Verdict::not_run;  // of what the backend offers
  bool begun = false;
  std::set<std::string> left_out = {};  // checks of what it does not offer
  const CheckRow* worst = nullptr;
  const CheckRow* first_stage = nullptr;  // that fails, in the order in which fields follow from each other
};

/// A row that fails is worse than one that passes, whatever their scores: some checks fail by
/// count.
bool worse(const CheckRow& a, const CheckRow& b) {
  const bool a_fails = verdict_of(a) == Verdict::fail;
  if (a_fails != (verdict_of(b) == Verdict::fail)) return a_fails;
  // NaN is the worst score there is.
  if (std::isnan(a.score) || std::isnan(b.score)) return std::isnan(a.score) && !std::isnan(b.score);
  return a.score > b.score;
}

Verdict combined(Verdict a, Verdict b) {
  if (a == Verdict::fail || b == Verdict::fail) return Verdict::fail;
  return a == Verdict::not_run || b == Verdict::not_run ? Verdict::not_run : Verdict::pass;
}

/// The stages of a substep, each from the one before: what goes wrong in one spoils the later ones.
bool is_stage(const CheckRow& row) {
  static const std::set<std::string> stages = {"neighbors", "boundary_volume", "density", "pressure"};
  return stages.count(row.check) > 0;
}

/// The worst row, and where it comes from.
std::string check_of(const Line& line) {
  if (!line.worst) return "-";
  const bool earlier = line.first_stage && line.first_stage->check != line.worst->check;
  return check_label(*line.worst) + (earlier ? fmt::format("; first: {}", line.first_stage->check) : "");
}

std::vector<Line> lines_of(const std::vector<CheckRow>& rows) {
  std::vector<Line> lines;
  for (const CheckRow& row : rows) {
    const std::string backend = backend_label(row);
    auto line = std::find_if(lines.begin(), lines.end(),
                             [&](const Line& l) { return l.backend == backend && l.fixture == row.fixture; });
    if (line == lines.end()) {
      lines.push_back({backend, row.fixture});
      line = lines.end() - 1;
    }
    if (is_left_out(row)) {
      line->left_out.insert(row.check);
      continue;
    }
    line->verdict = line->begun ? combined(line->verdict, verdict_of(row)) : verdict_of(row);
    line->begun = true;
    if (!line->first_stage && is_stage(row) && verdict_of(row) == Verdict::fail) line->first_stage = &row;
    if (row.verdict != Verdict::not_run && (!line->worst || worse(row, *line->worst))) line->worst = &row;
  }
  return lines;
}

std::string unit_of(const CheckRow& row) { return row.unit.empty() || row.unit == "1" ? "" : " " + row.unit; }

/// The values themselves, and where; empty where the row knows neither.
std::string details(const CheckRow& row) {
  std::string text;
  if (!std::isnan(row.expected)) {
    const char* components[] = {"x: ", "y: ", "z: "};
    const bool component = row.worst_component >= 0 && row.worst_component < 3;
    text += fmt::format("{}actual {:.9g}, expected {:.9g}{}", component ? components[row.worst_component] : "",
                        row.actual, row.expected, unit_of(row));
  }
  if (std::isnan(row.worst_x)) return text;
  if (!text.empty()) text += "; ";
  text += fmt::format("at ({:.6g}, {:.6g}, {:.6g}) m", row.worst_x, row.worst_y, row.worst_z);
  if (row.fluid_neighbors < 0) return text;
  text += fmt::format("; {} fluid neighbors", row.fluid_neighbors);
  if (!row.nearest.empty()) text += ", nearest " + row.nearest;
  return text + fmt::format("; {} wall neighbors", row.wall_neighbors);
}

/// Shortened in the middle to `width` bytes; the end of a name tells more than its middle.
std::string fitted(const std::string& text, std::size_t width) {
  if (text.size() <= width) return text;
  const std::size_t tail = (width - 2) / 2;
  return text.substr(0, width - 2 - tail) + ".." + text.substr(text.size() - tail);
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t indent) {
  std::string out, line;
  const std::size_t room = widest - indent;
  const auto flush = [&] {
    out += std::string(indent, ' ') + line + "\n";
    line.clear();
  };
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
    std::string word = text.substr(at, end - at);
    at = end + 1;
    if (!line.empty() && line.size() + 1 + word.size() > room) flush();
    while (word.size() > room) {
      line = word.substr(0, room);
      word.erase(0, room);
      flush();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  if (!line.empty()) flush();
  return out;
}

std::string backend_label(const CheckRow& row) {
  const auto options = row.options.empty() ? "" : "(" + row.options + ")";
  return row.backend + options + " " + row.executor;
}

std::string check_label(const CheckRow& row) {
  return row.check == row.field || row.field.empty() ? row.check : row.check + " / " + row.field;
}

std::string in_full(const CheckRow& row) {
  const Verdict verdict = verdict_of(row);
  std::string text = wrapped(
      fmt::format("{}: {} on {}: {}", to_string(verdict), backend_label(row), row.fixture, check_label(row)), 0);
  if (verdict == Verdict::fail && row.n > 0) {
    const std::string unit = unit_of(row);
    std::string figures = fmt::format("error {:.4g}{}, tolerance {:.4g}{}, score {:.3g}", row.error, unit,
                                      row.tolerance, unit, row.score);
    if (row.worst_id >= 0)
      figures = fmt::format("{}particle {}: ", row.field == "boundary_volume" ? "wall " : "", row.worst_id) + figures;
    figures += fmt::format("; median score {:.3g}", row.median_score);
    if (!std::isnan(row.fp32_reference_score))
      figures += fmt::format("; sequential fp32 scores {:.3g}", row.fp32_reference_score);
    figures += fmt::format("; {} compared", row.n);
    if (row.excluded > 0) figures += fmt::format(", {} ambiguous left out", row.excluded);
    text += wrapped(figures, 4) + wrapped(details(row), 4);
  }
  return text + wrapped(reason_of(row), 4);
}

namespace {

std::string counted(std::size_t n, const std::string& what) {
  return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
}

}  // namespace

std::string verdict_line(const Report& report) {
  const auto lines = lines_of(report.rows);
  if (lines.empty()) return "nothing was judged: not_run";
  std::set<std::string> fixtures, backends;
  std::size_t failing = 0, missing = 0;
  for (const auto& line : lines) {
    fixtures.insert(line.fixture);
    backends.insert(line.backend);
    failing += line.verdict == Verdict::fail;
    missing += line.verdict == Verdict::not_run;
  }
  std::string text = counted(fixtures.size(), "fixture") + " × " + counted(backends.size(), "backend") + ": ";
  if (failing == 0 && missing == 0) return text + "pass";
  text += failing > 0 ? "fail" : "not_run";
  std::string detail;
  if (failing > 0) detail = fmt::format("{} of {} fail", failing, lines.size());
  if (missing > 0) detail += fmt::format("{}{} of {} not run", detail.empty() ? "" : ", ", missing, lines.size());
  return text + " (" + detail + ")";
}

std::string console_table(const Report& report) {
  const auto lines = lines_of(report.rows);
  std::size_t backend_width = 7, fixture_width = 7;
  for (const auto& line : lines) {
    backend_width = std::max(backend_width, line.backend.size());
    fixture_width = std::max(fixture_width, line.fixture.size());
  }
  backend_width = std::min<std::size_t>(backend_width, 24);
  fixture_width = std::min<std::size_t>(fixture_width, 30);
  const std::size_t check_width = widest - backend_width - fixture_width - 27;

  std::string text = fmt::format("{:{}}  {:{}}  {:7}  {:>11}  {}\n", "backend", backend_width, "fixture", fixture_width,
                                 "verdict", "worst score", "check");
  for (const auto& line : lines)
    text +=
        fmt::format("{:{}}  {:{}}  {:7}  {:>11}  {}\n", fitted(line.backend, backend_width), backend_width,
                    fitted(line.fixture, fixture_width), fixture_width, to_string(line.verdict),
                    line.worst ? fmt::format("{:.3g}", line.worst->score) : "-", fitted(check_of(line), check_width));
  std::string rest;
  for (const auto& row : report.rows)
    if (verdict_of(row) != Verdict::pass && !is_left_out(row)) rest += in_full(row);
  std::set<std::string> left_out;
  for (const auto& line : lines)
    if (!line.left_out.empty())
      left_out.insert(
          fmt::format("{} does not offer what these need: {}\n", line.backend, fmt::join(line.left_out, ", ")));
  for (const auto& text_of_one : left_out) rest += text_of_one;
  if (!rest.empty()) text += "\n" + rest;
  return text + "\n" + verdict_line(report) + "\n";
}

}  // namespace decant
