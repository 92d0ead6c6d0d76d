/// \file
/// The values that must not slip through.
#pragma once

#include <limits>

namespace decant::test {

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

}  // namespace decant::test
