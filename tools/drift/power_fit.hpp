/// \file
/// y = a x^b through measured points, with what the points say about b.
#pragma once

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace decant::drift {

struct PowerFit {
  double power = std::numeric_limits<double>::quiet_NaN();
  double confidence = std::numeric_limits<double>::quiet_NaN();  // half width, 95 %

  bool admits(double b) const { return std::abs(power - b) <= confidence; }
};

/// Least squares of log y over log x through the points with both positive; NaN for fewer than four.
/// The 95 % are Student's, expanded about the normal quantile z in 1/(n − 2). Source: Abramowitz & Stegun,
/// Handbook of Mathematical Functions (1964), 26.7.5.
inline PowerFit fit_power(const std::vector<std::pair<double, double>>& points) {
  double n = 0, x = 0, y = 0;
  for (const auto& [a, b] : points)
    if (a > 0 && b > 0) n += 1, x += std::log(a), y += std::log(b);
  if (n < 4) return {};
  x /= n, y /= n;
  double xx = 0, xy = 0, yy = 0;
  for (const auto& [a, b] : points) {
    if (!(a > 0) || !(b > 0)) continue;
    const double u = std::log(a) - x, v = std::log(b) - y;
    xx += u * u, xy += u * v, yy += v * v;
  }
  if (xx == 0) return {};
  const double slope = xy / xx, free = n - 2, left = std::fmax(yy - slope * xy, 0) / free;
  constexpr double z = 1.959963985, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  const double t = z + (z3 + z) / (4 * free) + (5 * z5 + 16 * z3 + 3 * z) / (96 * free * free) +
                   (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * free * free * free);
  return {slope, t * std::sqrt(left / xx)};
}

}  // namespace decant::drift
