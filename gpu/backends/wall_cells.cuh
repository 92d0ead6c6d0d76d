/// \file
/// The cells of wall particles: one grid per container, in its own frame, built once; the moving ones in
/// the world and anew in every substep where that is asked for.
#pragma once

#include "gpu/kernels/boundary_volume.cuh"
#include "gpu/kernels/find_near_walls.cuh"
#include "gpu/kernels/neighbor_ranges.cuh"
#include "gpu/kernels/sort_sources.cuh"
#include "gpu/solver/context.cuh"

#include <algorithm>
#include <memory>
#include <optional>

namespace decant::gpu {
namespace {

class WallCells {
 public:
  struct Plan {
    bool have_cells;  // or all wall particles are candidates
    bool rebuild_moving;
    bool list_near;  // by cell, which wall particles may be within reach of it
    float reach;     // m

    bool operator==(const Plan&) const = default;
  };

  /// Fills in the segments of the store, and finds wall volumes; where all is as it was the last time, they are
  /// still there.
  void prepare(Stream& stream, const Constants& c, const ParticleArrays& a, WallStore& store, const Plan& plan,
               SortScratch& scratch) {
    const Prepared wanted{c, a.base, plan, store.version};
    if (prepared_ == wanted && !a.on_ranks()) {
      store.segments = prepared_segments_;
      return;
    }
    prepared_.reset();  // should anything below fail
    plan_ = plan;
    moves_ = store.moves;
    grids_.clear();
    near_.clear();
    const auto total = static_cast<std::size_t>(store.padded_total());
    from_.resize(total);
    from_id_.resize(total);
    room_.resize(total);
    stream.copy(from_.get(), store.walls.local, total * sizeof(float4));
    stream.copy(from_id_.get(), store.walls.id, total * sizeof(int));
    for (std::size_t k = 0; k < store.segments.size(); ++k)
      prepare(stream, c, a, store.walls, store.segments[k], rebuilt(k), scratch);
    segments_.upload(store.segments);
    stream.launch(place_walls_in_body_frame_kernel, store.padded_total(), PlaceWallsInBodyFrame{a, store.walls});
    for (std::size_t k = 0; k < store.segments.size(); ++k)
      with_periodic(c, [&](auto periodic) {
        using Neighbors = CellNeighbors<decltype(periodic)::value>;
        const WallSegment& s = store.segments[k];
        const Neighbors neighbors{{c}, candidates(a, {}, true), a};
        stream.launch_teams<Team>(
            boundary_volume_kernel<Team, Neighbors>, s.end - s.begin,
            BoundaryVolume<Neighbors>{c, a, neighbors, store.walls, static_cast<int>(k), s.begin});
      });
    bool any = false;
    for (std::size_t k = 0; k < store.segments.size(); ++k) {
      if (!rebuilt(k)) continue;
      any = true;
      WallSegment& s = store.segments[k];
      s.in_world = true;
      s.low = {-3.0e38f, -3.0e38f, -3.0e38f};
      s.high = {3.0e38f, 3.0e38f, 3.0e38f};
    }
    segments_.upload(store.segments);
    stream.wait();
    if (any) return;  // whose cells are of another time each time
    prepared_ = wanted;
    prepared_segments_ = store.segments;
    from_.resize(0);
    from_id_.resize(0);
    room_.resize(0);
  }

  /// What may be near, of these walls and of a fluid in cells or not.
  Candidates candidates(const ParticleArrays& a, const CellTable& fluid, bool all_fluid) const {
    return {all_fluid, !plan_.have_cells, a.n, a.base, fluid, a.containers, segments_.get()};
  }

  void rebuild(Stream& stream, const ParticleArrays& a, const WallStore& store, bool by_counting,
               SortScratch& scratch) {
    for (std::size_t k = 0; k < store.segments.size(); ++k) {
      if (!rebuilt(k)) continue;
      const WallSegment& s = store.segments[k];
      const WorldWallSource source{a, store.walls, frame_source(store.walls, s), s.begin, static_cast<int>(k)};
      if (by_counting) grids_[k]->sort_by_counting(stream, s.end - s.begin, source, scratch);
      else grids_[k]->sort_by_key(stream, s.end - s.begin, source, from_id_.get() + s.begin, scratch);
    }
  }

  std::size_t bytes() const {
    std::size_t sum = segments_.bytes() + from_.bytes() + from_id_.bytes() + room_.bytes();
    for (const auto& grid : grids_) sum += grid->bytes();
    for (const auto& near : near_) sum += near->bytes();
    return sum;
  }

 private:
#ifdef __CUDACC__
  using Team = SubWarp<4>;  // of the boundary volumes
#else
  using Team = SubWarp<1>;
#endif

  bool rebuilt(std::size_t k) const { return plan_.rebuild_moving && plan_.have_cells && moves_[k]; }

  void prepare(Stream& stream, const Constants& c, const ParticleArrays& a, const Walls& walls, WallSegment& s,
               bool again, SortScratch& scratch) {
    const int count = s.end - s.begin;
    const double low[3] = {s.low.x, s.low.y, s.low.z}, high[3] = {s.high.x, s.high.y, s.high.z};
    auto& grid = *grids_.emplace_back(std::make_unique<CellSort>());
    grid.prepare(stream,
                 make_cell_table(c, plan_.reach, low, high, std::max(4096.0, (plan_.list_near ? 4.0 : 2.0) * count)),
                 count, scratch);
    grid.sort_by_counting(stream, count, frame_source(walls, s), scratch);
    s.table = grid.table();
    if (!again) grid.keep_table_alone();
    if (plan_.list_near && !again) find_near(stream, c, a, walls, s, scratch);
    s.in_world = false;
    const float margin = 1.001f * plan_.reach, far = 3.0e38f;
    const auto out = [&](int axis, float x, float by) { return c.periodic[axis] ? (by < 0 ? -far : far) : x + by; };
    s.low = {out(0, s.low.x, -margin), out(1, s.low.y, -margin), out(2, s.low.z, -margin)};
    s.high = {out(0, s.high.x, margin), out(1, s.high.y, margin), out(2, s.high.z, margin)};
  }

  void find_near(Stream& stream, const Constants& c, const ParticleArrays& a, const Walls& walls, WallSegment& s,
                 SortScratch& scratch) {
    const auto buckets = static_cast<std::size_t>(s.table.buckets);
    Buffer<int> count(buckets + 1);
    auto& start = *near_.emplace_back(std::make_unique<Buffer<int>>(buckets + 1));
    auto& near = *near_.emplace_back(std::make_unique<Buffer<int>>());
    with_periodic(c, [&](auto periodic) {
      constexpr bool is_periodic = decltype(periodic)::value;
      FindNearWalls<is_periodic> find{s.table,     a.base + s.begin, s.begin,
                                      walls.local, {0, 0, 0},        plan_.reach * plan_.reach,
                                      count.get(), nullptr,          nullptr};
      const float low[3] = {s.low.x, s.low.y, s.low.z}, high[3] = {s.high.x, s.high.y, s.high.z};
      bool side_by_side = !c.any_periodic;
      for (int axis = 0; axis < 3; ++axis) {
        const double cells = (high[axis] - s.table.origin[axis]) * s.table.inverse_cell[axis];
        find.used[axis] = static_cast<int>(cells) + 1;
        side_by_side = side_by_side && cells >= 0 && low[axis] >= s.table.origin[axis] &&
                       find.used[axis] + 2 * CellTable::beyond(axis) < s.table.wrap[axis];
      }
      if (!side_by_side) find.used[0] = 0;
      stream.fill_zero(count.get(), count.bytes());
      stream.launch(find_near_walls_kernel<is_periodic>, s.table.buckets, find);
      stream.exclusive_scan(count.get(), start.get(), s.table.buckets + 1, scratch.scan);
      stream.wait();
      int total = 0;
      start.download_bytes(&total, start.get() + buckets, sizeof total);
      near.resize(static_cast<std::size_t>(total));
      find.count = nullptr;
      find.start = start.get();
      find.near = near.get();
      stream.launch(find_near_walls_kernel<is_periodic>, s.table.buckets, find);
    });
    stream.wait();
    s.near_start = start.get();
    s.near = near.get();
  }

  FrameWallSource frame_source(const Walls& walls, const WallSegment& s) const {
    return {from_.get() + s.begin, from_id_.get() + s.begin, walls.local + s.begin,
            walls.id + s.begin,    room_.get() + s.begin,    s.first_id};
  }

  /// What the cells and volumes follow from.
  struct Prepared {
    Constants c;
    int base;
    Plan plan;
    std::uint64_t version;

    bool operator==(const Prepared&) const = default;
  };

  Plan plan_{};
  std::optional<Prepared> prepared_;
  std::vector<WallSegment> prepared_segments_;
  std::vector<bool> moves_;
  std::vector<std::unique_ptr<CellSort>> grids_;
  std::vector<std::unique_ptr<Buffer<int>>> near_;
  Buffer<WallSegment> segments_;
  Buffer<float4> from_;
  Buffer<int> from_id_;
  Buffer<int2> room_;
};

}  // namespace
}  // namespace decant::gpu
