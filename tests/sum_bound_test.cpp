/// \file
/// The bound of a sum: no order of additions exceeds it, and where terms round alike it says so.
#include "oracle/solution/sum_bound.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace decant {
namespace {

constexpr double fp32_roundoff = 0x1p-24;

double bound(const std::vector<float>& terms, double inside = 0) {
  SumBound sum;
  for (const float t : terms) sum.add(static_cast<double>(t));
  CellCounter cells;
  return sum.error(fp32_roundoff, inside, cells);
}

double exact(const std::vector<float>& terms) {
  double sum = 0;
  for (const float t : terms) sum += static_cast<double>(t);
  return sum;
}

/// |fl(Σ) − Σ| in the order in which the terms stand.
double error(const std::vector<float>& terms) {
  float sum = 0;
  for (const float t : terms) sum += t;
  return std::abs(static_cast<double>(sum) - exact(terms));
}

TEST(SumBound, OfOneTermIsWhatIsInsideIt) {
  EXPECT_EQ(bound({3.0f}), 0);
  EXPECT_EQ(bound({3.0f}, 0.25), 0.25);
  EXPECT_EQ(bound({}, 0.25), 0.25);
}

TEST(SumBound, OfTwoTermsIsOneRounding) {
  EXPECT_EQ(bound({3.0f, -1.0f}), fp32_roundoff * 4);
  EXPECT_EQ(bound({1.0f, 0x1p-30f}), 0x1p-30) << "it is lost at most";
}

TEST(SumBound, GrowsWithTheNumberOfTermsThatRoundAlike) {
  // 9.81 and 400 equal terms: each addition is rounded the same way.
  const float t = 1.3f * 0x1p-20f;
  std::vector<float> terms(400, t);
  terms.insert(terms.begin(), 9.81f);
  const double size = exact(terms);
  EXPECT_GT(error(terms), 3 * std::sqrt(400.0) * fp32_roundoff * size) << "√n is not enough";
  EXPECT_LE(error(terms), bound(terms));
  EXPECT_LE(bound(terms), 400 * fp32_roundoff * size * (1 + 1e-9));
}

TEST(SumBound, OfDifferentTermsGrowsAsTheRootOfTheirNumber) {
  std::mt19937 random(1);
  std::vector<float> terms;
  for (int k = 0; k < 500; ++k) terms.push_back(std::uniform_real_distribution<float>(1, 2)(random));
  const double size = exact(terms);
  EXPECT_LT(bound(terms), 3 * std::sqrt(1000.0) * fp32_roundoff * size);
  EXPECT_GE(bound(terms), 3 * std::sqrt(500.0) * fp32_roundoff * size * (1 - 1e-9));
  // A worst case inside terms takes the place of what is rare in their order.
  EXPECT_DOUBLE_EQ(bound(terms, 500 * fp32_roundoff * size), bound(terms) / 3 + 500 * fp32_roundoff * size);
}

/// Whatever the terms, and whatever the order: by size, up and down, at random, in pairs.
TEST(SumBound, IsExceededByNoOrder) {
  std::mt19937 random(2);
  const auto real = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  double worst = 0;
  for (int k = 0; k < 20000; ++k) {
    std::vector<float> terms;
    const int n = std::uniform_int_distribution<int>(2, 60)(random);
    const double spread = real(0, 1) < 0.3 ? 0 : std::exp2(real(-26, 0)), scale = std::exp2(real(-30, 0)),
                 sign = real(0, 1);
    for (int j = 0; j < n; ++j)
      terms.push_back(static_cast<float>((real(0, 1) < sign ? 1 : -1) * scale * (1 + spread * real(-1, 1))));
    if (real(0, 1) < 0.5) terms.push_back(static_cast<float>(real(-10, 10)));
    const double tau = bound(terms);
    const auto by_size = [](float a, float b) { return std::abs(a) < std::abs(b); };
    for (int order = 0; order < 4; ++order) {
      if (order == 0) std::stable_sort(terms.begin(), terms.end(), by_size);
      if (order == 1) std::reverse(terms.begin(), terms.end());
      if (order >= 2) std::shuffle(terms.begin(), terms.end(), random);
      double off = error(terms);
      if (order == 3) {
        std::vector<float> level = terms;
        while (level.size() > 1) {
          std::vector<float> next;
          for (std::size_t i = 0; i < level.size(); i += 2)
            next.push_back(i + 1 < level.size() ? level[i] + level[i + 1] : level[i]);
          level = next;
        }
        off = std::abs(static_cast<double>(level[0]) - exact(terms));
      }
      // To first order in u: a partial sum is off by as much as it is rounded.
      if (off > 0) worst = std::max(worst, off / tau);
      ASSERT_LE(off, tau * (1 + 61 * fp32_roundoff)) << "case " << k << " order " << order;
    }
  }
  EXPECT_GT(worst, 0.5) << "a bound that is never approached is too loose";
}

TEST(SumBound, OfANumberThatIsNoneIsNone) { EXPECT_TRUE(std::isnan(bound({1.0f, std::nanf("")}))); }

}  // namespace
}  // namespace decant
