/// \file
/// Errors, tolerances, scores.
#include "oracle/checks/comparison.hpp"

#include <algorithm>
#include <cmath>

#if __FINITE_MATH_ONLY__
#error "compiled with -ffinite-math-only a comparator cannot see NaN"
#endif

namespace decant {
namespace {}  // namespace

void compare(const Values& v, CheckRow& row) {
  const auto n = v.expected.size();
  if (v.actual.size() != n) {
    row.verdict = Verdict::fail;
    row.score = infinity;
    row.reason = "has " + std::to_string(v.actual.size()) + " values, not " + std::to_string(n);
    return;
  }
  row.errors = (v.actual - v.expected).cwiseAbs();
  row.tolerances = v.tolerance;
  std::vector<double> scores;
  double worst = -1, float_worst = v.fp32_value.size() ? 0 : std::nan("");
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto particle = static_cast<std::size_t>(k / v.components);
    if (v.excluded && (*v.excluded)[particle]) {
      if (k % v.components == 0) ++row.excluded;
      // One whose own tolerance is wider than what is sane of others is held to that.
      if (std::isfinite(v.actual[k]) && v.actual[k] >= v.excluded_least &&
          (row.errors[k] <= v.excluded_tolerance || row.errors[k] <= v.tolerance[k])) {
        row.errors[k] = 0;
        continue;
      }
    }
    const bool insane = v.excluded && (*v.excluded)[particle];
    const double score = insane ? infinity : score_of(row.errors[k], v.tolerance[k]);
    scores.push_back(score);
    if (score > worst) {
      worst = score;
      row.error = row.errors[k];
      row.tolerance = v.tolerance[k];
      row.actual = v.actual[k];
      row.expected = v.expected[k];
      row.worst_id = static_cast<std::int64_t>(particle);
      row.worst_component = v.components > 1 ? k % v.components : -1;
    }
    if (v.fp32_value.size())
      float_worst = std::max(float_worst, score_of(std::abs(v.fp32_value[k] - v.expected[k]), v.tolerance[k]));
  }
  row.n = static_cast<std::int64_t>(scores.size());
  row.score = std::max(worst, 0.0);
  row.fp32_reference_score = float_worst;
  if (!scores.empty()) {
    auto middle = scores.begin() + static_cast<std::ptrdiff_t>(scores.size() / 2);
    std::nth_element(scores.begin(), middle, scores.end());
    row.median_score = *middle;
  }
  row.verdict = row.score <= 1 ? Verdict::pass : Verdict::fail;
  if (row.verdict == Verdict::fail) row.reason = "beyond tolerance";
  if (scores.empty() && n > 0) {
    row.verdict = Verdict::fail;
    row.reason = "every particle is ambiguous, nothing could be compared";
  }
  if (v.excluded && !(row.excluded <= v.most_excluded)) {
    row.verdict = Verdict::fail;
    row.reason =
        std::to_string(row.excluded) + " ambiguous particles, at most " + std::to_string(v.most_excluded) + " expected";
  }
}

void compare(double error, double tolerance, CheckRow& row, std::int64_t worst_id) {
  row.n = 1;
  row.error = error;
  row.tolerance = tolerance;
  row.worst_id = worst_id;
  row.score = row.median_score = score_of(error, tolerance);
  row.verdict = row.score <= 1 ? Verdict::pass : Verdict::fail;
  if (row.verdict == Verdict::fail) row.reason = "beyond tolerance";
}

RowBuilder::RowBuilder(const BackendInfo& info, const std::string& fixture) {
  common_.backend = info.name;
  common_.options = info.options;
  common_.executor = info.executor;
  common_.device = info.device;
  common_.fixture = fixture;
}

CheckRow& RowBuilder::row(const char* check, const std::string& field, const char* unit) {
  CheckRow& row = rows_.emplace_back(common_);
  row.check = check;
  row.field = field;
  row.unit = unit;
  row.fp32_reference_score = std::nan("");
  return row;
}

void RowBuilder::not_run(const char* check, const std::string& why) { row(check, "all", "").reason = why; }

void RowBuilder::failed(const char* check, const std::string& why) {
  CheckRow& r = row(check, "all", "");
  r.verdict = Verdict::fail;
  r.score = infinity;
  r.reason = why;
}

}  // namespace decant
