/// \file
/// Neighbor lists that come from another program, checked before they are used.
#pragma once

#include "reference/state.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace decant {

/// Throws for whoever reads them. \param part  "_count" or "": of the numbers of entries, or of the entries
using RefuseList = std::function<void(const char* part, const std::string& value, const std::string& bound)>;

/// The number of entries, [particles], each 0 to targets; their sum.
std::int64_t checked_entries(const IdVector& count, std::int64_t targets, const RefuseList& refuse);

/// Lists of all particles, each ascending. Entries are 0 to targets − 1, each once per list.
/// \param entries  [sum of count] \param of_fluid  no particle is in its own list, and pairs are in the lists of both
/// particles: a list that has each pair once, as many codes keep it, would read as one that misses half of them
std::vector<std::vector<std::int32_t>> checked_lists(const IdVector& count, const IdVector& entries,
                                                     std::int64_t targets, bool of_fluid, const RefuseList& refuse);

}  // namespace decant
