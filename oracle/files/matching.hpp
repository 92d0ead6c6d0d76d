/// \file
/// Values in another order than the oracle's are matched by id, and only where every id is there
/// once.
#pragma once

#include "reference/state.hpp"

#include <string>
#include <vector>

namespace decant {

struct Matching {
  std::vector<Eigen::Index> place;  // of each expected id in what was found; empty where ids do not match
  /// Ids that are missing, there twice, or of no particle; and the smallest of each kind in words.
  std::int64_t faults = 0;
  std::string mismatch;

  bool ok() const { return faults == 0; }
  /// Columns (or values) in the expected order.
  template <class Matrix>
  Matrix ordered(const Matrix& found) const {
    if constexpr (Matrix::ColsAtCompileTime == 1) return found(place).eval();
    else return found(Eigen::all, place).eval();
  }
};

/// \param expected  each id once; \param found  any
Matching match_ids(const IdVector& expected, const IdVector& found);

}  // namespace decant
