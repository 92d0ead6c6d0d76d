/// \file
/// Every entry is looked at once.
#include "oracle/lists/given_lists.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace decant {
namespace {

void require_both_directions(const std::vector<std::vector<std::int32_t>>& lists, const RefuseList& refuse) {
  std::int64_t entries = 0;
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (const std::int32_t j : lists[i]) {
      ++entries;
      const auto& back = lists[static_cast<std::size_t>(j)];
      if (std::binary_search(back.begin(), back.end(), static_cast<std::int32_t>(i))) return;
    }
  if (entries > 1)
    refuse("", fmt::format("{} pairs, none of them in both lists", entries),
           "every pair in the lists of both its particles; a half list has to be written out");
}

}  // namespace

std::int64_t checked_entries(const IdVector& count, std::int64_t targets, const RefuseList& refuse) {
  std::int64_t sum = 0;
  for (const std::int64_t c : count) {
    if (c < 0 || c > targets) refuse("_count", fmt::format("{}", c), fmt::format("0 to {}", targets));
    sum += c;
  }
  return sum;
}

std::vector<std::vector<std::int32_t>> checked_lists(const IdVector& count, const IdVector& entries,
                                                     std::int64_t targets, bool of_fluid, const RefuseList& refuse) {
  std::vector<std::vector<std::int32_t>> lists(static_cast<std::size_t>(count.size()));
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < lists.size(); ++i) {
    auto& list = lists[i];
    for (std::int64_t c = 0; c < count[static_cast<Eigen::Index>(i)]; ++c) {
      const std::int64_t j = entries[at++];
      if (j < 0 || j >= targets)
        refuse("", fmt::format("entry {} of particle {}", j, i), fmt::format("0 to {}", targets - 1));
      if (of_fluid && j == static_cast<std::int64_t>(i))
        refuse("", fmt::format("particle {} in its own list", i), "others only");
      list.push_back(static_cast<std::int32_t>(j));
    }
    std::sort(list.begin(), list.end());
    if (const auto twice = std::adjacent_find(list.begin(), list.end()); twice != list.end())
      refuse("", fmt::format("entry {} of particle {} twice", *twice, i), "each neighbor once");
  }
  if (of_fluid) require_both_directions(lists, refuse);
  return lists;
}

}  // namespace decant
