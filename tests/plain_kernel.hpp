/// \file
/// The kernel families once more, as the papers print them, for tests that must not ask kernel.hpp.
#pragma once

#include "reference/scene.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace decant::test {

constexpr std::array families = {KernelFamily::cubic_spline, KernelFamily::wendland_c2, KernelFamily::mueller2003};

inline std::string family_name(const testing::TestParamInfo<KernelFamily>& family) {
  return std::array{"CubicSpline", "WendlandC2", "Mueller2003"}[static_cast<int>(family.param)];
}

/// h = H/2, q = r/h; zero from r = H on.
struct PlainKernel {
  KernelFamily family;
  double H;  // m

  /// W, 1/m³.
  double W(double r) const {
    const double h = H / 2, q = r / h;
    if (r >= H) return 0;
    if (family == KernelFamily::mueller2003) return 315 / (64 * pi * std::pow(H, 9)) * std::pow(H * H - r * r, 3);
    if (family == KernelFamily::wendland_c2)
      return 21 / (16 * pi * std::pow(h, 3)) * std::pow(1 - q / 2, 4) * (2 * q + 1);
    const double piece = q < 1 ? 1 - 1.5 * q * q + 0.75 * q * q * q : 0.25 * std::pow(2 - q, 3);
    return piece / (pi * std::pow(h, 3));
  }

  /// −W' (mueller2003: minus the spiky kernel's), 1/m⁴.
  double slope(double r) const {
    const double h = H / 2, q = r / h;
    if (r >= H) return 0;
    if (family == KernelFamily::mueller2003) return 45 / (pi * std::pow(H, 6)) * std::pow(H - r, 2);
    if (family == KernelFamily::wendland_c2) return 105 / (16 * pi * std::pow(h, 4)) * q * std::pow(1 - q / 2, 3);
    const double piece = q < 1 ? 3 * q - 2.25 * q * q : 0.75 * std::pow(2 - q, 2);
    return piece / (pi * std::pow(h, 4));
  }

  /// 1/m⁵, r > 0.
  double G(double r) const { return slope(r) / r; }

  /// 1/m⁵.
  double L(double r) const {
    const double h = H / 2;
    if (r >= H) return 0;
    if (family == KernelFamily::mueller2003) return 45 / (pi * std::pow(H, 6)) * (H - r);
    return 2 * r * slope(r) / (r * r + 0.01 * h * h);
  }

  static constexpr double pi = std::numbers::pi;
};

}  // namespace decant::test
