/// \file
/// One table of columns serves writing and reading.
#include "oracle/files/report_file.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/vtkhdf.hpp"
#include "reference/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace decant {
namespace {

// Bytes that whole arrays may take in a report, and then how many rows keep how many worst values:
// with the summary of some thousand rows the file stays below 15 MB.
constexpr std::int64_t whole_arrays_budget = 8'000'000;
constexpr int rows_with_worst_values = 300;
constexpr Eigen::Index worst_values = 256;

using TextColumn = std::string CheckRow::*;
using IntegerColumn = std::int64_t CheckRow::*;
using RealColumn = double CheckRow::*;

constexpr std::array<std::pair<const char*, TextColumn>, 10> text_columns = {{
    {"backend", &CheckRow::backend},
    {"options", &CheckRow::options},
    {"executor", &CheckRow::executor},
    {"device", &CheckRow::device},
    {"fixture", &CheckRow::fixture},
    {"check", &CheckRow::check},
    {"field", &CheckRow::field},
    {"unit", &CheckRow::unit},
    {"reason", &CheckRow::reason},
    {"nearest", &CheckRow::nearest},
}};
constexpr std::array<std::pair<const char*, IntegerColumn>, 6> integer_columns = {{
    {"n", &CheckRow::n},
    {"worst_id", &CheckRow::worst_id},
    {"worst_component", &CheckRow::worst_component},
    {"excluded", &CheckRow::excluded},
    {"fluid_neighbors", &CheckRow::fluid_neighbors},
    {"wall_neighbors", &CheckRow::wall_neighbors},
}};
struct Reals {
  const char* name;
  RealColumn member;
  const char* unit;           // empty: the row's, or none
  const char* name_2 = name;  // in schema 2
};
constexpr std::array<Reals, 10> real_columns = {{
    {"error", &CheckRow::error, "", "value"},
    {"tolerance", &CheckRow::tolerance, ""},
    {"score", &CheckRow::score, ""},
    {"median_score", &CheckRow::median_score, ""},
    {"fp32_reference_score", &CheckRow::fp32_reference_score, "", "float_score"},
    {"actual", &CheckRow::actual, "", "got"},
    {"expected", &CheckRow::expected, ""},
    {"worst_x", &CheckRow::worst_x, "m"},
    {"worst_y", &CheckRow::worst_y, "m"},
    {"worst_z", &CheckRow::worst_z, "m"},
}};

Eigen::VectorXd real_column(const std::vector<CheckRow>& rows, RealColumn member) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) values[static_cast<Eigen::Index>(k)] = rows[k].*member;
  return values;
}

void write_summary(Hdf5Writer& out, const std::vector<CheckRow>& rows) {
  for (const auto& [name, member] : text_columns) {
    std::vector<std::string> values;
    for (const auto& row : rows) values.push_back(member == &CheckRow::reason ? reason_of(row) : row.*member);
    out.strings(std::string("/summary/") + name, values);
  }
  std::vector<std::string> verdicts;
  for (const auto& row : rows) verdicts.push_back(to_string(verdict_of(row)));
  out.strings("/summary/verdict", verdicts, "pass, fail or not_run");
  for (const auto& [name, member] : integer_columns) {
    IdVector values(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t k = 0; k < rows.size(); ++k) values[static_cast<Eigen::Index>(k)] = rows[k].*member;
    out.integers(std::string("/summary/") + name, values);
  }
  for (const auto& [name, member, unit, name_2] : real_columns)
    out.vector(std::string("/summary/") + name, real_column(rows, member), unit);

  std::vector<Eigen::VectorXd> quantiles(quantile_percent.size(),
                                         Eigen::VectorXd(static_cast<Eigen::Index>(rows.size())));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto q = quantiles_of(rows[k]);
    for (std::size_t p = 0; p < q.size(); ++p) quantiles[p][static_cast<Eigen::Index>(k)] = q[p];
  }
  for (std::size_t p = 0; p < quantiles.size(); ++p)
    out.vector(fmt::format("/summary/score_p{}", quantile_percent[p]), quantiles[p], "1",
               fmt::format("{} % of the values score at most this", quantile_percent[p]));
}

/// Arrays of one failing row, whole or the worst values; the rest is in the summary.
void write_check(Hdf5Writer& out, const std::string& group, const CheckRow& row, bool whole) {
  Eigen::VectorXd error = row.errors, tolerance = row.tolerances;
  if (!whole) {
    const Eigen::VectorXd scores = scores_of(row);
    IdVector order = IdVector::LinSpaced(scores.size(), 0, scores.size() - 1);
    const Eigen::Index kept = std::min(worst_values, scores.size());
    std::partial_sort(order.begin(), order.begin() + kept, order.end(), [&](std::int64_t a, std::int64_t b) {
      return scores[a] != scores[b] ? scores[a] > scores[b] : a < b;
    });
    const IdVector worst = order.head(kept);
    error = row.errors(worst).eval();
    tolerance = row.tolerances(worst).eval();
    out.integers(group + "/index", worst, "place in the whole array, worst first");
  }
  out.vector(group + "/error", error, row.unit, "|error|", Storage::fp32);
  out.vector(group + "/tolerance", tolerance, row.unit, "allowed |error|", Storage::fp32);
  out.attribute(group, "backend", row.backend);
  out.attribute(group, "fixture", row.fixture);
  out.attribute(group, "check", row.check);
  out.attribute(group, "field", row.field);
  out.attribute(group, "kept", whole ? "whole" : "worst");
}

void write_checks(Hdf5Writer& out, const std::vector<CheckRow>& rows) {
  out.group("/checks");
  std::int64_t budget = whole_arrays_budget;
  int worst_left = rows_with_worst_values;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const CheckRow& row = rows[k];
    if (verdict_of(row) != Verdict::fail || !has_arrays(row)) continue;
    const std::int64_t bytes = row.errors.size() * 2 * 4 + 4096;
    const bool whole = bytes <= budget;
    if (whole) budget -= bytes;
    if (!whole && worst_left-- <= 0) continue;
    write_check(out, fmt::format("/checks/{:06}", k), row, whole);
  }
}

/// A field's name in schema 2 as it is now.
std::string today(const std::string& field) {
  for (const auto& [before, now] : {std::pair("moved ", "translated "), std::pair("turned ", "rotated ")})
    if (field.starts_with(before)) return now + field.substr(std::string_view(before).size());
  return field;
}

}  // namespace

void write_report(const std::filesystem::path& file, const Report& report) {
  const auto& rows = report.rows;
  const int status = exit_status(report);
  Hdf5Writer out(file, 9);
  out.attribute("/", "decant_report", report_schema);
  out.attribute("/", "verdict", status == 0 ? "pass" : status == 1 ? "fail" : "not_run");
  write_summary(out, rows);
  write_checks(out, rows);
  if (report.neighborhood) write_vtkhdf(out, *report.neighborhood);
  out.group("/provenance");
  for (const auto& [name, text] : report.provenance) out.attribute("/provenance", name, text);
  out.commit();
}

Report read_report(const std::filesystem::path& file) {
  const Hdf5Reader in(file);
  const std::int64_t schema = in.integer_attribute("/", "decant_report");
  if (schema != report_schema && schema != 2)
    in.fail("/@decant_report", std::to_string(schema), fmt::format("2 or {}", report_schema));
  Report report;
  const std::vector<std::string> verdicts = in.strings("/summary/verdict");
  const auto n = static_cast<std::int64_t>(verdicts.size());
  report.rows.resize(verdicts.size());
  for (const auto& [name, member] : text_columns) {
    auto values = in.strings(std::string("/summary/") + name, n);
    for (std::size_t k = 0; k < values.size(); ++k) report.rows[k].*member = std::move(values[k]);
  }
  for (const auto& [name, member] : integer_columns) {
    const IdVector values = in.integers(std::string("/summary/") + name, n);
    for (Eigen::Index k = 0; k < n; ++k) report.rows[static_cast<std::size_t>(k)].*member = values[k];
  }
  for (const auto& [name, member, unit, name_2] : real_columns) {
    const Eigen::VectorXd values = in.vector(std::string("/summary/") + (schema == 2 ? name_2 : name), n);
    for (Eigen::Index k = 0; k < n; ++k) report.rows[static_cast<std::size_t>(k)].*member = values[k];
  }
  for (const int percent : quantile_percent) {
    const Eigen::VectorXd values = in.vector(fmt::format("/summary/score_p{}", percent), n);
    for (Eigen::Index k = 0; k < n; ++k) report.rows[static_cast<std::size_t>(k)].score_quantiles.push_back(values[k]);
  }
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    const std::string& text = verdicts[k];
    if (text != "pass" && text != "fail" && text != "not_run")
      in.fail("/summary/verdict", fmt::format("{} at {}", text, k), "pass, fail or not_run");
    report.rows[k].verdict = text == "pass" ? Verdict::pass : text == "fail" ? Verdict::fail : Verdict::not_run;
  }
  if (schema == 2)
    for (CheckRow& row : report.rows) row.field = today(row.field);
  for (const auto& name : in.attribute_names("/provenance"))
    report.provenance[name] = in.text_attribute("/provenance", name);
  return report;
}

}  // namespace decant
