/// \file
/// How far a sum in finite precision may be from the exact one whatever the order of its additions.
///
/// One addition errs by no more than fl(S + t) − (S + t) <= min(u |S + t|, |S|, |t|): S and t are both
/// numbers that the result could have been. With T = Σ|t_k|, over any order and any tree of additions,
///
///   E1 = Σ_k min(u T, |t_k|)   over all k but the largest,
///
/// to first order in u: an addition among tiny terms is rounded by u times their own small sum, and a
/// partial sum B of tiny terms that joins a larger one loses at most |B|. No order exceeds E1.
///
/// Where terms differ, their roundings do too and partly cancel, so that √n takes the place of n
/// (Higham & Mary, SIAM J. Sci. Comput. 41 (2019), theorem 2.8). Two kinds of terms round alike and add
/// up: those whose values agree within 2uT, a last place of the largest partial sum (neighbors on a
/// lattice), and those smaller than that, which are lost as a whole or rounded up as a whole. With m_g the
/// number of terms in cell g of width 2uT, |t_k| >= 2uT,
///
///   E2 = u T √(Σ_g m_g²) + Σ_{|t_k| < 2uT} |t_k|,
///
/// cell g holding 2uT g <= t < 2uT (g + 1). A rounding spreads evenly over ± u T at most,
/// with a deviation of u T/√3, so that E2 is √3 deviations of the sum's error and 3 E2 five: one value in five
/// million exceeds it.
///
/// What happens inside the terms, I, is a worst case that adds up; it is never met together with five
/// deviations of the order. So the bound of a whole sum is
///
///   E1 + I                              where E1 <= E2: no order exceeds it
///   max(min(E1, 3 E2), E2 + I)          elsewhere
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace decant {

/// Unit roundoff of the oracle: what it is compared with is never exact either.
inline constexpr double reference_roundoff = 0x1p-53;

/// Counts how many terms share a cell: Σ m², term by term. Memory is kept from sum to sum.
class CellCounter {
 public:
  /// Makes room for a sum of n terms, and forgets the last one.
  void begin(std::size_t n);
  void add(std::int32_t cell) {
    std::size_t k = (static_cast<std::uint32_t>(cell) * 2654435769u) >> shift_;
    while (slots_[k].sum == sum_ && slots_[k].cell != cell) k = (k + 1) & (slots_.size() - 1);
    Slot& slot = slots_[k];
    if (slot.sum != sum_) slot = {sum_, cell, 0};
    squares_ += 2 * slot.count++ + 1;
  }
  double squares() const { return static_cast<double>(squares_); }

 private:
  struct Slot {
    std::uint32_t sum = 0;  // the sum it was last used for
    std::int32_t cell = 0;
    std::int32_t count = 0;
  };
  std::vector<Slot> slots_;
  unsigned shift_ = 0;
  std::uint32_t sum_ = 0;
  std::int64_t squares_ = 0;
};

class SumBound {
 public:
  void clear() {
    terms_.clear();
    size_ = 0;
  }
  void add(double term) {
    terms_.push_back(term);
    size_ += std::abs(term);
  }
  void add(const SumBound& other);
  /// T = Σ|t|, in the terms' unit.
  double size() const { return size_; }
  /// The bound of the sum, in the terms' unit.
  /// \param u  unit roundoff of the additions; \param inside  I, what the terms themselves are off
  double error(double u, double inside, CellCounter& cells) const;

 private:
  std::vector<double> terms_;
  double size_ = 0;
};

}  // namespace decant
