/// \file
/// What backends with cells and lists share: the size of their tables, how many threads work on a particle, and
/// the memory of the lists.
#pragma once

#include "gpu/kernels/cell_sort.cuh"
#include "gpu/kernels/neighbor_ranges.cuh"
#include "gpu/solver/context.cuh"

#include <algorithm>
#include <cmath>

namespace decant::gpu {
namespace {

/// From here on a particle's bytes count more than how long a warp waits, and few are near walls.
inline bool is_large(int particles) { return particles >= 300000; }

/// Threads per particle that kernels are compiled for, at most. Each number takes its time to compile, and few use
/// periodic scenes, or cells without lists.
template <bool rarely_used>
inline constexpr int most_lanes = rarely_used ? 2 : 8;

/// The order of sums is that of the cells. So that it depends on the state at hand alone and not on one
/// that was once loaded, which a resumed pour does not know, the table is the scene's.
struct SceneCells {
  Constants c;
  Box region;    // of make_region
  double reach;  // at which neighbors are looked for, m
  int particles;

  CellTable whole() const { return over(region); }

  /// Of a rank of a large scene: as long and as wide as the rank's part of it. Cells are the same, and where one
  /// thread works on a particle so is the order.
  void follow(Stream& stream, CellSort& fluid, const Box& where, int room, SortScratch& scratch) const {
    if (!is_large(particles)) return;
    CellTable table = over({{std::max(region.min.x, where.min.x), std::max(region.min.y, where.min.y),
                             std::max(region.min.z, where.min.z)},
                            {std::min(region.max.x, where.max.x), std::min(region.max.y, where.max.y),
                             std::min(region.max.z, where.max.z)}});
    const CellTable& now = fluid.table();
    if (std::equal(table.wrap, table.wrap + 3, now.wrap)) return;
    std::copy(now.origin, now.origin + 3, table.origin);
    fluid.prepare(stream, table, room, scratch);
  }

 private:
  CellTable over(const Box& box) const {
    const double low[3] = {box.min.x, box.min.y, box.min.z};
    double high[3] = {box.max.x, box.max.y, box.max.z};
    for (int a = 0; a < 3; ++a) {
      // What falls out of a cup stays within a few times its size, if it stays in the domain.
      const double most = high[a] - low[a] + 16.0 * reach;
      const double domain = double(c.domain_max[a]) - c.domain_min[a];
      high[a] = low[a] + std::min(most, domain);
    }
    return make_cell_table(c, reach, low, high, std::max(4096.0, (is_large(particles) ? 2.5 : 5.0) * particles));
  }
};

/// Lists of n particles, `lanes` for each.
class ListStorage {
 public:
  /// \param ratio     radius of the lists by H
  /// \param capacity  entries per thread; 0: what a dense fluid needs
  void choose_capacity(int capacity, double ratio, int lanes) {
    capacity_ = capacity ? capacity : static_cast<int>(std::ceil(41 * ratio * ratio * ratio / lanes));
    if (!capacity && lanes > 1) capacity_ += 4;
  }
  void reserve(int n, int lanes) {
    lanes_ = lanes;
    entries_.resize(0);  // before the larger ones take their room
    capacity_ = (capacity_ + 3) / 4 * 4;
    const std::size_t threads = static_cast<std::size_t>(lanes) * static_cast<std::size_t>(n);
    entries_.resize(Lists::room(threads, capacity_));
    counts_.resize(threads);
  }
  /// Room for `longest` entries per thread. Whether anything changed.
  bool grow(int n, int longest) {
    if (longest <= capacity_) return false;
    capacity_ = longest + 4;
    reserve(n, lanes_);
    return true;
  }
  Lists lists(const ParticleArrays& a) const { return {entries_.get(), lanes_, capacity_, a.sentinel, counts_.get()}; }
  std::size_t bytes() const { return entries_.bytes() + counts_.bytes(); }

 private:
  int lanes_ = 1, capacity_ = 0;
  Buffer<int4> entries_;
  Buffer<int> counts_;
};

/// Whether a scene is the one that was loaded before: its lists' capacity is then known to serve.
class LoadedScene {
 public:
  bool is(const Constants& c, int particles, const Box& region) const {
    return particles_ == particles && H_ == c.H && std::memcmp(&region_, &region, sizeof region) == 0;
  }
  void set(const Constants& c, int particles, const Box& region) {
    particles_ = particles;
    H_ = c.H;
    region_ = region;
  }

 private:
  int particles_ = -1;
  float H_ = 0;
  Box region_{};
};

}  // namespace
}  // namespace decant::gpu
