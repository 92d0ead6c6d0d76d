/// \file
/// The cheapest list that stays within a tolerance everywhere it was measured.
#include "reference/larger.hpp"
#include "tools/drift/drift.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace decant::drift {
namespace {

/// The row of that list; all adaptive lists are one.
const Row* same_list(const Result& result, const ListChoice& list) {
  for (const Row& row : result.rows)
    if (row.list.interval == list.interval && (list.interval == 0 || row.list.skin == list.skin)) return &row;
  return nullptr;
}

}  // namespace

std::unique_ptr<Recommendation> recommend(const std::vector<Result>& results, double tolerance) {
  std::unique_ptr<Recommendation> best;
  if (results.empty()) return best;
  const auto parts = static_cast<double>(results.size());
  std::vector<Recommendation> beyond;
  for (const Row& candidate : results.front().rows) {
    Recommendation r{candidate.list, 0, 0, 0, 0};
    bool everywhere = true;
    for (const Result& result : results) {
      const Row* row = same_list(result, candidate.list);
      const Row* adaptive = same_list(result, {0, not_measured, false});
      everywhere = everywhere && row && adaptive && !std::isnan(row->substep_us);
      if (!everywhere) break;
      r.worst_error = larger(r.worst_error, row->acceleration_rms);
      r.expected_error = larger(r.expected_error, row->expected.acceleration_rms);
      r.substep_us += row->substep_us / parts;
      r.adaptive_us += adaptive->substep_us / parts;
    }
    if (!everywhere) continue;
    if (!(r.worst_error <= 0.5 * tolerance)) beyond.push_back(r);
    else if (!best || r.substep_us < best->substep_us) best = std::make_unique<Recommendation>(r);
  }
  for (const Recommendation& r : beyond) {
    if (!best || r.substep_us >= best->substep_us || best->next_error <= r.worst_error) continue;
    best->next_us = r.substep_us;
    best->next_error = r.worst_error;
  }
  return best;
}

}  // namespace decant::drift
