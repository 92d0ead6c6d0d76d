/// \file
/// Curves by linear interpolation.
#include "tools/validation/curves.hpp"

#include "reference/error.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <string>

namespace decant::validate {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Curve read_curve(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw InputError(file.string(), "(whole file)", "not readable", "a file of points x,y");
  std::vector<std::pair<double, double>> points;
  bool named = false;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    if (!named) {
      named = true;
      continue;
    }
    const char* const end = line.data() + line.size();
    double x = 0, y = 0;
    const auto first = std::from_chars(line.data(), end, x);
    bool good = first.ec == std::errc{} && first.ptr != end && *first.ptr == ',';
    if (good) {
      const auto second = std::from_chars(first.ptr + 1, end, y);
      good = second.ec == std::errc{} && second.ptr == end && std::isfinite(x) && std::isfinite(y);
    }
    if (!good)
      throw InputError(file.string(), "line " + std::to_string(number), line,
                       "two finite numbers with a comma between them");
    points.emplace_back(x, y);
  }
  if (points.size() < 2) throw InputError(file.string(), "points", std::to_string(points.size()), "at least 2");
  std::stable_sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  Curve curve;
  for (const auto& [x, y] : points) {
    curve.x.push_back(x);
    curve.y.push_back(y);
  }
  return curve;
}

double value_at(const Curve& curve, double x) {
  if (curve.x.empty() || !(x >= curve.x.front()) || !(x <= curve.x.back())) return nan;
  const auto above = std::lower_bound(curve.x.begin(), curve.x.end(), x);
  const auto k = static_cast<std::size_t>(above - curve.x.begin());
  if (curve.x[k] == x) return curve.y[k];
  const double s = (x - curve.x[k - 1]) / (curve.x[k] - curve.x[k - 1]);
  return curve.y[k - 1] + s * (curve.y[k] - curve.y[k - 1]);
}

double first_reach(const Curve& curve, double y) {
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    if (!(curve.y[k] >= y)) continue;
    if (k == 0 || curve.y[k] == curve.y[k - 1]) return curve.x[k];
    const double s = (y - curve.y[k - 1]) / (curve.y[k] - curve.y[k - 1]);
    return curve.x[k - 1] + s * (curve.x[k] - curve.x[k - 1]);
  }
  return nan;
}

std::pair<double, double> first_reach_between(const Curve& curve, double y) {
  for (std::size_t k = 0; k < curve.x.size(); ++k)
    if (curve.y[k] >= y) return {curve.x[k > 0 ? k - 1 : 0], curve.x[k]};
  return {nan, nan};
}

Curve part_of(const Curve& curve, double a, double b) {
  Curve part;
  for (std::size_t k = 0; k < curve.x.size(); ++k)
    if (curve.x[k] >= a && curve.x[k] <= b) {
      part.x.push_back(curve.x[k]);
      part.y.push_back(curve.y[k]);
    }
  return part;
}

double integral(const Curve& curve, double a, double b) {
  const double first = value_at(curve, a), last = value_at(curve, b);
  if (!(a <= b) || std::isnan(first) || std::isnan(last)) return nan;
  Curve inside = part_of(curve, a, b);
  inside.x.insert(inside.x.begin(), a);
  inside.y.insert(inside.y.begin(), first);
  inside.x.push_back(b);
  inside.y.push_back(last);
  double sum = 0;
  for (std::size_t k = 1; k < inside.x.size(); ++k)
    sum += 0.5 * (inside.y[k] + inside.y[k - 1]) * (inside.x[k] - inside.x[k - 1]);
  return sum;
}

double slope(const Curve& curve, double a, double b) {
  const Curve part = part_of(curve, a, b);
  if (part.x.size() < 2) return nan;
  const auto n = static_cast<double>(part.x.size());
  const double x_mean = std::accumulate(part.x.begin(), part.x.end(), 0.0) / n;
  const double y_mean = std::accumulate(part.y.begin(), part.y.end(), 0.0) / n;
  double xy = 0, xx = 0;
  for (std::size_t k = 0; k < part.x.size(); ++k) {
    xy += (part.x[k] - x_mean) * (part.y[k] - y_mean);
    xx += (part.x[k] - x_mean) * (part.x[k] - x_mean);
  }
  return xx > 0 ? xy / xx : nan;
}

}  // namespace decant::validate
