/// \file
/// How ranks share space: a box each, chosen by samples of all particles; how far ghosts reach beyond H; and how many
/// substeps that serves for, by the speed of the fastest particle.
#pragma once

#include "gpu/core/stream.cuh"
#include "gpu/kernels/migrate.cuh"
#include "gpu/ranks/communicator.hpp"
#include "gpu/ranks/partition.hpp"
#include "gpu/solver/device_solver.hpp"

#include <algorithm>
#include <cmath>

namespace decant::gpu {
namespace {

class Decomposition {
 public:
  /// \param margin  of H; negative: by the speed of the fastest particle
  Decomposition(Communicator& ranks, float margin) : ranks_(ranks), margin_of_h_(margin) {}

  void load(const Problem& problem) {
    step_ = 0;
    place_boxes(problem.constants, problem.rank_boxes, problem.particles);
  }
  RankBoxes boxes() const { return {ranks_.rank(), count(), own_boxes_.get(), reach_boxes_.get()}; }
  /// Where this rank's own particles and ghosts are.
  const Box& reach() const { return reach_; }
  /// The same on the device, for walls; null where they are near across a period.
  const Box* walls_within() const { return periodic_ ? nullptr : reach_boxes_.get() + ranks_.rank(); }
  /// Ghosts serve until a particle has moved by half of it, m.
  float margin() const { return margin_; }

  /// How far the fastest particle moved in the last substep, m.
  void note_step(double step) { step_ = step; }
  /// Whatever else happens, everything may fall freely: k step + ½ k² fall is half the margin.
  double substeps_that_fit() const {
    const double b = 1.1 * step_;
    return std::floor(margin_ / (b + std::sqrt(b * b + fall_ * margin_) + 1e-30)) + 1;
  }

  /// New boxes, and the speed of the fastest particle.
  void survey(Stream& stream, const Constants& c, const ParticleArrays& a) {
    const int every = std::max(1, a.total / (samples * count())), room = a.total / every + 1;
    Buffer<float4> position(static_cast<std::size_t>(room));
    Buffer<int> id(static_cast<std::size_t>(room)), found(2);  // samples, speed
    stream.fill_zero(found.get(), found.bytes());
    stream.launch(survey_kernel, a.n, Survey{a, every, room, position.get(), id.get(), found.get(), found.get() + 1});
    stream.wait();
    const std::vector<int> counted = found.download(2);
    fall_ = c.dt * c.dt * std::sqrt(c.gravity.x * c.gravity.x + c.gravity.y * c.gravity.y + c.gravity.z * c.gravity.z);
    step_ = c.dt * std::sqrt(unordered(counted[1])) + fall_;
    for (const double other : ranks_.all(step_)) step_ = std::max(step_, other);
    const auto n = static_cast<std::size_t>(std::min(counted[0], room));
    const std::vector<float4> x = position.download(n);
    const std::vector<int> ids = id.download(n);
    std::vector<Sample> own;
    for (std::size_t k = 0; k < n; ++k) own.push_back({ids[k], {{x[k].x, x[k].y, x[k].z}, 1.0f}});
    choose_boxes(c, own, a.total);
  }

 private:
  static constexpr int samples = 4096;  // per rank

  struct Sample {
    int id;
    WorkSample work;
  };

  int count() const { return ranks_.size(); }

  /// What ghosts cost grows with the margin m, their layers beside n particles; what migrations cost falls with it,
  /// one in m H / (2 step) substeps. The sum is least at m² = (step/H) n^⅓ (dx/H) (cost of a migration by that of a
  /// substep) / (cost of a ghost by that of a particle), the latter two about 1 and 1 as measured.
  float chosen_margin(const Constants& c, int total) const {
    if (margin_of_h_ >= 0) return margin_of_h_ * c.H;
    const double dx = std::cbrt(c.mass * c.inverse_rest_density), n = static_cast<double>(total) / count();
    return static_cast<float>(std::clamp(std::sqrt(step_ / c.H * std::cbrt(n) * dx / c.H), 0.1, 3.0)) * c.H;
  }
  void place_boxes(const Constants& c, const std::vector<Box>& boxes, int total) {
    margin_ = chosen_margin(c, total);
    periodic_ = c.any_periodic;
    std::vector<Box> reach = boxes;
    for (Box& box : reach) {
      float *low = &box.min.x, *high = &box.max.x;
      for (int a = 0; a < 3; ++a) {
        // A periodic axis has no outside, and an image of everything would lie in an infinite box.
        if (c.periodic[a]) {
          low[a] = std::max(low[a], c.domain_min[a]);
          high[a] = std::min(high[a], c.domain_min[a] + c.period[a]);
        }
        const float width = 1.001f * (c.H + margin_) + 0x1p-19f * (c.period[a] + extent(low[a]) + extent(high[a]));
        low[a] -= width;
        high[a] += width;
      }
    }
    own_boxes_.upload(boxes);
    reach_boxes_.upload(reach);
    reach_ = reach[static_cast<std::size_t>(ranks_.rank())];
  }
  static float extent(float x) { return std::isfinite(x) ? std::fabs(x) : 0.0f; }
  void choose_boxes(const Constants& c, const std::vector<Sample>& own, int total) {
    Writer packed;
    packed << own;
    std::vector<Sample> all;
    for (const Bytes& of_rank : ranks_.gather(packed.take())) {
      std::vector<Sample> some;
      Reader(of_rank) >> some;
      all.insert(all.end(), some.begin(), some.end());
    }
    std::vector<Box> boxes;
    if (ranks_.rank() == 0) {
      std::ranges::sort(all, {}, &Sample::id);
      std::vector<WorkSample> work;
      for (const Sample& s : all) work.push_back(s.work);
      boxes = bisect(std::move(work), count());
    }
    Writer chosen;
    chosen << boxes;
    Bytes bytes = chosen.take();
    ranks_.broadcast(bytes);
    Reader(bytes) >> boxes;
    place_boxes(c, boxes, total);
  }

  Communicator& ranks_;
  float margin_of_h_, margin_ = 0;  // m
  bool periodic_ = false;
  Box reach_{};
  double step_ = 0;  // how far the fastest particle moves in a substep, m
  double fall_ = 0;  // and by how much farther in each next one if it falls, m
  Buffer<Box> own_boxes_, reach_boxes_;
};

}  // namespace
}  // namespace decant::gpu
