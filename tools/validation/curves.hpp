/// \file
/// Arithmetic on curves, and the measured ones as files hold them.
#pragma once

#include <filesystem>
#include <utility>
#include <vector>

namespace decant::validate {

/// Points in ascending x.
struct Curve {
  std::vector<double> x, y;
};

/// A file of measured points: lines that begin with # cite, one names the two columns, the others hold x,y.
/// Points are sorted by x. Throws InputError naming the line.
Curve read_curve(const std::filesystem::path& file);

/// y at x, linear between points; NaN outside the curve.
double value_at(const Curve& curve, double x);

/// The first x at which the curve rises to y, linear between points; NaN where it never does.
double first_reach(const Curve& curve, double y);

/// Where first_reach lies as far as the points tell: x of the last point below y, and of the next one.
std::pair<double, double> first_reach_between(const Curve& curve, double y);

/// ∫ y dx from a to b, by trapezoids on the curve's own points; NaN where the curve does not span it.
double integral(const Curve& curve, double a, double b);

/// Least-squares slope of the points with a <= x <= b; NaN for fewer than two.
double slope(const Curve& curve, double a, double b);

/// The points with a <= x <= b.
Curve part_of(const Curve& curve, double a, double b);

}  // namespace decant::validate
