/// \file
/// Ids against ids.
#include "oracle/files/matching.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace decant {

Matching match_ids(const IdVector& expected, const IdVector& found) {
  std::map<std::int64_t, std::vector<Eigen::Index>> places;
  for (Eigen::Index k = 0; k < found.size(); ++k) places[found[k]].push_back(k);
  Matching matching;
  std::map<std::int64_t, std::string> first;  // by kind of fault
  const auto fault = [&](int kind, const std::string& text) {
    ++matching.faults;
    first.emplace(kind, text);
  };
  IdVector sorted = expected;
  std::sort(sorted.begin(), sorted.end());
  for (const std::int64_t id : sorted) {
    const auto at = places.find(id);
    if (at == places.end()) {
      fault(0, fmt::format("id {} is missing", id));
    } else if (at->second.size() > 1) {
      fault(1, fmt::format("id {} is there {} times", id, at->second.size()));
    }
  }
  for (const auto& [id, where] : places)
    if (!std::binary_search(sorted.begin(), sorted.end(), id)) fault(2, fmt::format("id {} is of no particle", id));
  if (matching.ok()) {
    for (const std::int64_t id : expected) matching.place.push_back(places[id].front());
    return matching;
  }
  for (const auto& [kind, text] : first) matching.mismatch += (matching.mismatch.empty() ? "" : ", ") + text;
  if (matching.faults > static_cast<std::int64_t>(first.size()))
    matching.mismatch += fmt::format("; {} ids in all", matching.faults);
  return matching;
}

}  // namespace decant
