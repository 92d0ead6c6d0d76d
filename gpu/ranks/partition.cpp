/// \file
/// Recursive coordinate bisection (Berger, Bokhari: A partitioning strategy for nonuniform problems on
/// multiprocessors, IEEE Trans. Comput. C-36, 1987): across the longest extent, where the work of both sides is as
/// their numbers of ranks are.
#include "gpu/ranks/partition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace decant::gpu {
namespace {

float along(int axis, const Float3& v) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
float& along(int axis, Float3& v) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

int longest_axis(std::span<const WorkSample> samples) {
  float longest = -1;
  int axis = 0;
  for (int a = 0; a < 3; ++a) {
    float low = std::numeric_limits<float>::max(), high = -low;
    for (const WorkSample& s : samples) {
      low = std::min(low, along(a, s.position));
      high = std::max(high, along(a, s.position));
    }
    if (high - low > longest) {
      longest = high - low;
      axis = a;
    }
  }
  return axis;
}

void divide(std::span<WorkSample> samples, const Box& box, int ranks, std::vector<Box>& boxes) {
  if (ranks == 1) {
    boxes.push_back(box);
    return;
  }
  const int axis = longest_axis(samples), first = ranks / 2;
  std::sort(samples.begin(), samples.end(), [axis](const WorkSample& a, const WorkSample& b) {
    return along(axis, a.position) < along(axis, b.position);
  });
  double total = 0, below = 0;
  for (const WorkSample& s : samples) total += s.work;
  std::size_t k = 0;
  while (k < samples.size() && below + 0.5 * samples[k].work < total * first / ranks) below += samples[k++].work;
  // Without samples anywhere is as good.
  float cut = std::max(along(axis, box.min), std::min(0.0f, along(axis, box.max)));
  if (k == 0 && !samples.empty()) cut = along(axis, samples[0].position);
  else if (k == samples.size() && k > 0) cut = along(axis, samples[k - 1].position);
  else if (k > 0)
    cut = along(axis, samples[k - 1].position) +
          0.5f * (along(axis, samples[k].position) - along(axis, samples[k - 1].position));
  Box lower = box, upper = box;
  along(axis, lower.max) = along(axis, upper.min) = cut;
  divide(samples.first(k), lower, first, boxes);
  divide(samples.subspan(k), upper, ranks - first, boxes);
}

}  // namespace

std::vector<Box> bisect(std::vector<WorkSample> samples, int ranks) {
  std::erase_if(samples, [](const WorkSample& s) {
    return !(std::isfinite(s.position.x) && std::isfinite(s.position.y) && std::isfinite(s.position.z) && s.work > 0);
  });
  constexpr float infinity = std::numeric_limits<float>::infinity();
  std::vector<Box> boxes;
  divide(samples, {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}}, ranks, boxes);
  return boxes;
}

double imbalance(const std::vector<double>& work) {
  double sum = 0, most = 0;
  for (const double w : work) {
    sum += w;
    most = std::max(most, w);
  }
  return sum > 0 ? most * static_cast<double>(work.size()) / sum : 1;
}

}  // namespace decant::gpu
