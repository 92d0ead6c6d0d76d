/// \file
/// The largest of values among which NaN may be: it must not get lost.
#pragma once

#include <cmath>

namespace decant {

/// The larger one; NaN where either is, so that a largest value that was NaN once stays so.
inline double larger(double a, double b) { return std::isnan(a) || b <= a ? a : b; }

}  // namespace decant
