/// \file
/// Terms are kept, because what rounds alike is known only once T is.
#include "oracle/solution/sum_bound.hpp"

#include <algorithm>
#include <bit>

namespace decant {

void CellCounter::begin(std::size_t n) {
  const std::size_t slots = std::bit_ceil(std::max<std::size_t>(2 * n, 64));
  if (slots > slots_.size() || ++sum_ == 0) {
    slots_.assign(std::max(slots, slots_.size()), {});
    sum_ = 1;
    shift_ = 32 - static_cast<unsigned>(std::bit_width(slots_.size()) - 1);
  }
  squares_ = 0;
}

void SumBound::add(const SumBound& other) {
  terms_.insert(terms_.end(), other.terms_.begin(), other.terms_.end());
  size_ += other.size_;
}

double SumBound::error(double u, double inside, CellCounter& cells) const {
  const double ulp = u * size_;
  if (!(ulp > 0 && std::isfinite(size_))) return ulp + inside;  // nothing to round, or NaN to hand on
  cells.begin(terms_.size());
  // |t| / (u T) < 2^23: a positive number is truncated as it is rounded down.
  constexpr double above_all = 0x1p26;
  const double per_cell = 1 / (2 * ulp);
  double worst = 0, largest = 0, tiny = 0;
  for (const double t : terms_) {
    const double size = std::abs(t), loss = std::min(ulp, size);
    worst += loss;
    largest = std::max(largest, loss);
    if (size < 2 * ulp) {
      tiny += size;
      continue;
    }
    cells.add(static_cast<std::int32_t>(t * per_cell + above_all));
  }
  worst -= largest;
  const double typical = ulp * std::sqrt(cells.squares()) + tiny;
  if (worst <= typical) return worst + inside;
  return std::max(std::min(worst, 3 * typical), typical + inside);
}

}  // namespace decant
