/// \file
/// The three kernel families: norm, slope, edge of support and moments, by quadrature and by
/// differences.
#include "reference/kernel.hpp"
#include "tests/generators.hpp"
#include "tests/plain_kernel.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace decant::test {
namespace {

constexpr double supports[] = {0.02, 1.0, 250.0};  // H, m

/// Central difference of f at r.
template <class Function>
double slope_of(Function&& f, double r, double step) {
  return (f(r + step) - f(r - step)) / (2 * step);
}

/// ∫ f(r) 4πr² dr over the support, by Simpson's rule. H/2, where the spline's two pieces meet,
/// lies between two of its parabolas.
template <class Function>
double over_support(double H, Function&& f) {
  const int n = 4000;
  double sum = 0;
  for (int k = 0; k <= n; ++k) {
    const double r = H * k / n, weight = k == 0 || k == n ? 1 : k % 2 == 1 ? 4 : 2;
    sum += weight * f(r) * 4 * std::numbers::pi * r * r;
  }
  return sum * H / n / 3;
}

class EveryKernel : public testing::TestWithParam<KernelFamily> {};
INSTANTIATE_TEST_SUITE_P(All, EveryKernel, testing::ValuesIn(families), family_name);

TEST_P(EveryKernel, IntegratesToOneOverItsSupport) {
  for (const double H : supports) {
    const Kernel<double> kernel(GetParam(), H);
    EXPECT_NEAR(over_support(H, [&](double r) { return kernel.W(r); }), 1, 1e-11) << "H = " << H;
  }
}

TEST_P(EveryKernel, HasAGradientThatIsTheSlopeOfItsKernel) {
  for (const double H : supports) {
    const Kernel<double> kernel(GetParam(), H);
    const auto kernel_of_gradient = [&](double r) {
      const double spiky = 15 / (std::numbers::pi * std::pow(H, 6)) * std::pow(H - r, 3);
      return GetParam() == KernelFamily::mueller2003 ? spiky : kernel.W(r);
    };
    for (int k = 0; k < 200; ++k) {
      const double r = H * (k + 0.5) / 200;
      EXPECT_NEAR(-r * kernel.G(r) / slope_of(kernel_of_gradient, r, 1e-6 * H), 1, 1e-4)
          << "H = " << H << ", r/H = " << r / H;
      EXPECT_NEAR(-r * kernel.G(r), slope_of(kernel_of_gradient, r, 1e-6 * H), 1e-8 * kernel.W(0) / H);
    }
  }
}

TEST_P(EveryKernel, VanishesAtTheEdgeOfSupport) {
  for (const double H : supports) {
    const Kernel<double> kernel(GetParam(), H);
    EXPECT_EQ(kernel.W(H), 0);
    EXPECT_EQ(kernel.G(H), 0);
    EXPECT_EQ(kernel.L(H), 0);
    const double inside = H * (1 - 1e-3);
    EXPECT_GT(kernel.W(inside), 0);
    EXPECT_LT(kernel.W(inside), 1e-7 * kernel.W(0));
    EXPECT_GT(kernel.G(inside), 0);
    EXPECT_LT(kernel.G(inside), 1e-4 * kernel.G(H / 2));
  }
}

TEST_P(EveryKernel, GivesALinearPressureItsGradient) {
  for (const double H : supports) {
    const Kernel<double> kernel(GetParam(), H);
    EXPECT_NEAR(over_support(H, [&](double r) { return r * r * kernel.G(r) / 3; }), 1, 1e-10);
  }
}

TEST_P(EveryKernel, GivesAQuadraticVelocityItsLaplacianUpToTheSoftening) {
  const double expected[] = {0.9902, 0.9887, 1.0};
  for (const double H : supports) {
    const Kernel<double> kernel(GetParam(), H);
    EXPECT_NEAR(over_support(H, [&](double r) { return r * r * kernel.L(r) / 6; }),
                expected[static_cast<int>(GetParam())], 5e-5);
  }
}

TEST_P(EveryKernel, SumsToItsLatticeDensityAtTwoSpacings) {
  const double expected[] = {1.0000, 1.0338, 1.0098};
  const double dx = 0.01, H = 2 * dx;
  const Kernel<double> kernel(GetParam(), H);
  double sum = 0;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k) sum += dx * dx * dx * kernel.W(dx * std::hypot(i, j, k));
  EXPECT_NEAR(sum, expected[static_cast<int>(GetParam())], 5e-5);
}

TEST_P(EveryKernel, HasTheValuesThatThePapersGive) {
  EXPECT_TRUE(rc::check("Kernel == PlainKernel", [family = GetParam()] {
    const double H = std::exp(real(-7, 7)), r = real(1e-6, 1) * H;
    const Kernel<double> kernel(family, H);
    const PlainKernel plain{family, H};
    RC_ASSERT(std::abs(kernel.W(r) - plain.W(r)) <= 1e-13 * plain.W(0));
    RC_ASSERT(std::abs(r * kernel.G(r) - plain.slope(r)) <= 1e-13 * plain.W(0) / H);
    RC_ASSERT(std::abs(kernel.L(r) - plain.L(r)) <= 1e-12 * plain.L(H / 2));
  }));
}

TEST_P(EveryKernel, IsFiniteWhereTwoParticlesCoincide) {
  const Kernel<double> kernel(GetParam(), 1.0);
  const bool mueller = GetParam() == KernelFamily::mueller2003;
  EXPECT_EQ(kernel.L(0), mueller ? 45 / std::numbers::pi : 0);
  EXPECT_TRUE(std::isfinite(kernel.W(0)) && std::isfinite(kernel.G(0)));
  EXPECT_NEAR(kernel.W(0), PlainKernel({GetParam(), 1.0}).W(0), 1e-14);
}

TEST_P(EveryKernel, IsNarrowerInSinglePrecisionByRoundingAlone) {
  const Kernel<double> kernel(GetParam(), 0.02);
  const Kernel<float> narrow(GetParam(), 0.02);
  for (int k = 1; k < 200; ++k) {
    const double r = 0.02 * k / 200;
    const auto rounded = static_cast<float>(r);
    EXPECT_NEAR(narrow.W(rounded), kernel.W(r), 1e-6 * kernel.W(0));
    EXPECT_NEAR(narrow.G(rounded), kernel.G(r), 2e-6 * kernel.G(r) + 1e-6 * kernel.G(0.01));
    EXPECT_NEAR(narrow.L(rounded), kernel.L(r), 2e-6 * kernel.L(r) + 1e-6 * kernel.L(0.01));
  }
}

TEST_P(EveryKernel, KnowsItsOwnSlopes) {
  const double H = 1.0;
  const Kernel<double> kernel(GetParam(), H);
  double steepest_L = 0, largest_bound = 0;
  for (int k = 0; k < 200; ++k) {
    const double r = H * (k + 0.5) / 200, step = 1e-6 * H;
    const double w = slope_of([&](double s) { return kernel.W(s); }, r, step);
    const double g = slope_of([&](double s) { return kernel.G(s); }, r, step);
    const double l = std::abs(slope_of([&](double s) { return kernel.L(s); }, r, step));
    EXPECT_NEAR(kernel.slope_W(r), -w, 1e-8 * kernel.W(0)) << "r/H = " << r;
    EXPECT_NEAR(kernel.slope_G(r), -g, 1e-6 * kernel.slope_G(r) + 1e-7 * kernel.G(H / 2)) << r;
    EXPECT_GE(kernel.slope_L(r), l * (1 - 1e-6) - 1e-7 * kernel.L(H / 2)) << "r/H = " << r;
    steepest_L = std::max(steepest_L, l);
    largest_bound = std::max(largest_bound, kernel.slope_L(r));
  }
  EXPECT_LT(largest_bound, 2 * steepest_L);
}

}  // namespace
}  // namespace decant::test
