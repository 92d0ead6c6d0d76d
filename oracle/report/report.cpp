/// \file
/// The report's verdicts.
#include "oracle/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace decant {

bool has_arrays(const CheckRow& row) { return row.errors.size() > 0 && row.errors.size() == row.tolerances.size(); }

double score_of(double error, double tolerance) {
  if (!(tolerance >= 0 && tolerance < std::numeric_limits<double>::infinity()))
    return std::numeric_limits<double>::infinity();
  if (error == 0) return 0;
  const double score = error / tolerance;
  return score >= 0 ? score : std::numeric_limits<double>::infinity();  // NaN, whatever made it
}

Eigen::VectorXd scores_of(const CheckRow& row) {
  return row.errors.binaryExpr(row.tolerances,
                               [](double error, double tolerance) { return score_of(std::abs(error), tolerance); });
}

std::vector<double> quantiles_of(const CheckRow& row) {
  if (!has_arrays(row))
    return row.score_quantiles.size() == quantile_percent.size()
               ? row.score_quantiles
               : std::vector<double>(quantile_percent.size(), no_number);
  Eigen::VectorXd scores = scores_of(row);
  std::sort(scores.begin(), scores.end());
  std::vector<double> q;
  for (const int percent : quantile_percent)
    q.push_back(scores[std::lround(percent / 100.0 * static_cast<double>(scores.size() - 1))]);
  return q;
}

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::fail:
      return "fail";
    case Verdict::not_run:
      return "not_run";
  }
  return "fail";
}

Verdict verdict_of(const CheckRow& row) {
  const bool stands = row.score >= 0 && row.score <= 1 && !std::isnan(row.error) && !std::isnan(row.tolerance);
  return row.verdict == Verdict::pass && !stands ? Verdict::fail : row.verdict;
}

std::string reason_of(const CheckRow& row) {
  if (verdict_of(row) == row.verdict) return row.reason;
  return fmt::format("said to pass with score {}, error {}, tolerance {}", row.score, row.error, row.tolerance);
}

void condense(CheckRow& row) {
  row.score_quantiles = quantiles_of(row);
  if (verdict_of(row) != Verdict::pass) return;
  row.errors.resize(0);
  row.tolerances.resize(0);
}

int exit_status(const Report& report) {
  bool fails = false, missing = false, judged = false;
  for (const auto& row : report.rows) {
    const Verdict verdict = verdict_of(row);
    fails |= verdict == Verdict::fail;
    missing |= verdict == Verdict::not_run && !is_left_out(row);
    judged |= verdict != Verdict::not_run;
  }
  missing |= !judged;
  return fails ? 1 : missing ? 3 : 0;
}

}  // namespace decant
