/// \file
/// The spatial hash and the neighbor lists: one search, because a hash that remembers its pairs for
/// the force pass is a list rebuilt every substep, and a list is a hash that is not rebuilt yet.
///
/// hash: every substep sorts the fluid into cells; the density pass tests the cells around and writes
/// what it finds into lists for the force pass (or, `pairs=rescan`, the force pass tests cells again).
/// list: lists reach to H and a skin; the sort and the lists are made when a trigger asks for it,
/// decided on the device.
#pragma once

#include "gpu/collect.cuh"
#include "gpu/grid_sources.cuh"
#include "gpu/pipeline.cuh"
#include "gpu/verify.cuh"

#include <algorithm>
#include <cmath>

namespace decant::gpu::DECANT_EXECUTOR {

class GridSearch {
 public:
  GridSearch(const SolverOptions& options, bool reuses) : o_(options), reuses_(reuses) {}

  static constexpr bool points_carry_square = false;

  void load(Queue& queue, const Constants& c, const Arrays& a, const WallStore& walls,
            const std::vector<float>& positions) {
    c_ = c;
    n_ = a.n;
    walls_ = walls;
    widest_skin_ = !reuses_ ? 0.0f : static_cast<float>(o_.skin < 0 ? widest : o_.skin) * c.H;
    reach_ = c.H + widest_skin_;
#ifdef __CUDACC__
    lanes_ = o_.lanes ? o_.lanes : fitting_lanes();
#endif
    sort_fluid_ = !(reuses_ && o_.build == SolverOptions::Build::all_pairs);
    prepare_fluid(queue, positions, a.containers);
    prepare_walls(queue, a);
    if (capacity_ == 0) {
      const double ratio = !reuses_ ? 1 : 1 + (o_.skin < 0 ? usual : o_.skin);
      capacity_ = o_.capacity ? o_.capacity
                              : static_cast<int>(std::ceil(41 * ratio * ratio * ratio / lanes_));
      if (!o_.capacity && lanes_ > 1) capacity_ += 4;
    }
    reserve_lists();
  }

  void arrange(Arrays& a, const Particles& state, const Particles& spare) const {
    state_ = state;
    spare_ = spare;
    // Lists put particles back where they were, in the new order; a hash leaves them sorted.
    a.now = reuses_ ? state : spare;
    a.next = state;
  }
  /// Before an advance or an evaluation: the skin of its lists.
  void begin(Queue& queue, const Arrays& a) {
    if (counts_ahead()) {
      fluid_.clear(queue);
      queue.for_each(n_, fluid_.counter(fluid_source(a, {}), scratch_));
    }
    if (!reuses_) return;
    if (o_.skin < 0) queue.for_each(n_, FastestPass{a, state_.velocity});
    const float least = o_.skin < 0 ? static_cast<float>(narrowest) * c_.H : widest_skin_;
    queue.for_each(1, SkinPass{c_, a.mailbox, least, widest_skin_});
  }
  bool capturable() const { return o_.graphs && o_.sort == SolverOptions::Sort::counting; }

  template <bool periodic, bool facts>
  void density(Queue& queue, const Arrays& a, const DeviceGeometry& geometry,
               const FieldArrays& out, const Laps& laps) {
    if (reuses_)
      queue.when(&a.mailbox->stale, [&] { build<periodic>(queue, a, geometry, laps); });
    else
      build<periodic>(queue, a, geometry, laps);
    if (o_.verify)
      with_lanes(lanes_, [&](auto lanes) {
        verifier_.template count<decltype(lanes)::value>(
            queue, c_, a, candidates(a), list_query<periodic>(a), o_.rebuild == 0, scratch_);
      });
    with_query<periodic>(a, [&](auto lanes, const auto& query) {
      using Pass = DensityPass<std::decay_t<decltype(query)>, facts>;
      queue.for_each_group<decltype(lanes)::value>(n_, Pass{c_, a, query, out, walls_.walls.id});
    });
    laps.density();
  }

  template <bool periodic, bool facts>
  void force(Queue& queue, const Arrays& a, const FieldArrays& out, const Laps& laps) {
    with_query<periodic>(a, [&](auto lanes, const auto& query) {
      using Pass = ForcePass<std::decay_t<decltype(query)>, facts>;
      queue.for_each_group<decltype(lanes)::value>(n_, Pass{c_, a, query, out});
    });
    laps.force();
    // The ids are in the order of the cells now; so must be the state, which stays as it is.
    if (!facts || reuses_) return;
    const auto bytes = static_cast<std::size_t>(n_) * sizeof(float4);
    queue.copy(state_.position, spare_.position, bytes);
    queue.copy(state_.velocity, spare_.velocity, bytes);
  }

  template <bool periodic>
  void move(Queue& queue, const Arrays& a, const DeviceGeometry& geometry, const Laps& laps,
            bool more) {
    const Watch w = watch(queue, more);
    const auto run = [&](const auto& after) {
      using Pass = IntegratePass<std::decay_t<decltype(after)>>;
      queue.for_each(n_ + walls_.moving_count(), Pass{c_, a, geometry, walls_.moving(a), after});
    };
    if (reuses_)
      run(WatchParticle<periodic>{c_, a, w});
    else if (counts_ahead())
      run(CountCell{fluid_.counter(fluid_source(a, geometry), scratch_)});
    else
      run(Nothing{});
    if (w.trigger == Trigger::local) queue.for_each(w.supers, ComparePass{w, a.mailbox});
    laps.integrate();
  }

  /// More entries a particle, so that `longest` fits. Whether anything changed.
  bool grow(int longest) {
    if (longest <= capacity_) return false;
    capacity_ = longest + 4;
    reserve_lists();
    return true;
  }

  std::size_t bytes() const {
    std::size_t sum = fluid_.bytes() + scratch_.bytes() + bucket_.bytes() + lists_.bytes() +
                      counts_.bytes() + origin_.bytes() + built_.bytes() + boxes_.bytes() + verifier_.bytes() +
                      segments_.bytes() + wall_from_.bytes() + wall_from_id_.bytes() + wall_room_.bytes();
    for (const auto& grid : wall_grids_) sum += grid->bytes();
    for (const auto& near : near_) sum += near->bytes();
    return sum;
  }

 private:
  /// Few particles do not fill the chip: more lanes for each.
  int fitting_lanes() const {
    if (n_ < 25000) return n_ < 8000 && !reuses_ ? 8 : 4;
    return large() ? 1 : 2;
  }
  /// From here on a particle's bytes count more than how long a warp waits, and few are near walls.
  bool large() const { return n_ >= 300000; }
  bool keeps_pairs() const { return reuses_ || o_.pairs == SolverOptions::Pairs::keep; }
  bool walls_have_cells() const { return reuses_ ? sort_fluid_ : o_.grid == SolverOptions::Grid::all; }

  void prepare_fluid(Queue& queue, const std::vector<float>& positions, int containers) {
    double low[3], high[3];
    bounds(positions, low, high);
    for (int a = 0; a < 3; ++a) {
      // What falls out of a cup stays within a few times its size, if it stays in the domain.
      const double most = 3 * (high[a] - low[a]) + 16.0 * reach_;
      const double domain = double(c_.domain_max[a]) - c_.domain_min[a];
      high[a] = low[a] + std::min(most, domain);
    }
    const CellTable table =
        make_cell_table(c_, reach_, low, high, std::max(4096.0, (large() ? 2.5 : 5.0) * n_));
    fluid_.prepare(queue, table, n_, scratch_);
    if (!reuses_) return;
    if (o_.verify) verifier_.prepare(queue, table, n_, scratch_);
    origin_.resize(static_cast<std::size_t>(n_));
    built_.resize(static_cast<std::size_t>(containers));
    if (watch().trigger != Trigger::local) return;
    bucket_.resize(static_cast<std::size_t>(n_));
    boxes_.resize(2 * static_cast<std::size_t>(table.supers()));
  }

  void prepare_walls(Queue& queue, const Arrays& a) {
    wall_grids_.clear();
    near_.clear();
    const auto total = static_cast<std::size_t>(walls_.padded_total());
    wall_from_.resize(total);
    wall_from_id_.resize(total);
    wall_room_.resize(total);
    queue.copy(wall_from_.get(), walls_.walls.local, total * sizeof(float4));
    queue.copy(wall_from_id_.get(), walls_.walls.id, total * sizeof(int));
    for (std::size_t k = 0; k < walls_.segments.size(); ++k) {
      WallSegment& s = walls_.segments[k];
      const int count = s.end - s.begin;
      const double low[3] = {s.low.x, s.low.y, s.low.z}, high[3] = {s.high.x, s.high.y, s.high.z};
      auto& grid = *wall_grids_.emplace_back(std::make_unique<CellSort>());
      grid.prepare(queue, make_cell_table(c_, reach_, low, high, std::max(4096.0, 4.0 * count)),
                   count, scratch_);
      grid.counting(queue, count, frame_source(s), scratch_);
      s.table = grid.table();
      if (!rebuilt(k) && !large()) find_near(queue, a, s);
      s.in_world = false;
      const float margin = 1.001f * reach_, far = 3.0e38f;
      const auto out = [&](int axis, float x, float by) {
        return c_.periodic[axis] ? (by < 0 ? -far : far) : x + by;
      };
      s.low = {out(0, s.low.x, -margin), out(1, s.low.y, -margin), out(2, s.low.z, -margin)};
      s.high = {out(0, s.high.x, margin), out(1, s.high.y, margin), out(2, s.high.z, margin)};
    }
    segments_.upload(walls_.segments);
    queue.for_each(walls_.padded_total(), UnposedPass{a, walls_.walls});
    for (std::size_t k = 0; k < walls_.segments.size(); ++k)
      with_periodic(c_, [&](auto periodic) {
        constexpr bool p = decltype(periodic)::value;
        const WallSegment& s = walls_.segments[k];
        queue.for_each_group<4>(
            s.end - s.begin, VolumePass<CellQuery<p>>{c_, a, cell_query<p>(a), walls_.walls,
                                                      static_cast<int>(k), s.begin});
      });
    bool any = false;
    for (std::size_t k = 0; k < walls_.segments.size(); ++k) {
      if (!rebuilt(k)) continue;
      any = true;
      WallSegment& s = walls_.segments[k];
      s.in_world = true;
      s.low = {-3.0e38f, -3.0e38f, -3.0e38f};
      s.high = {3.0e38f, 3.0e38f, 3.0e38f};
    }
    segments_.upload(walls_.segments);
    queue.wait();
    if (any) return;
    wall_from_.resize(0);
    wall_from_id_.resize(0);
    wall_room_.resize(0);
  }

  void find_near(Queue& queue, const Arrays& a, WallSegment& s) {
    const auto buckets = static_cast<std::size_t>(s.table.buckets);
    Buffer<int> count(buckets + 1);
    auto& start = *near_.emplace_back(std::make_unique<Buffer<int>>(buckets + 1));
    auto& near = *near_.emplace_back(std::make_unique<Buffer<int>>());
    with_periodic(c_, [&](auto periodic) {
      using Pass = NearPass<decltype(periodic)::value>;
      Pass pass{s.table, a.base + s.begin, s.begin, walls_.walls.local, {0, 0, 0}, reach_ * reach_,
                count.get(), nullptr, nullptr};
      const float low[3] = {s.low.x, s.low.y, s.low.z}, high[3] = {s.high.x, s.high.y, s.high.z};
      bool side_by_side = !c_.any_periodic;
      for (int axis = 0; axis < 3; ++axis) {
        const double cells = (high[axis] - s.table.origin[axis]) * s.table.inverse_cell[axis];
        pass.used[axis] = static_cast<int>(cells) + 1;
        side_by_side = side_by_side && cells >= 0 && low[axis] >= s.table.origin[axis] &&
                       pass.used[axis] + 2 * CellTable::beyond(axis) < s.table.wrap[axis];
      }
      if (!side_by_side) pass.used[0] = 0;
      queue.fill_zero(count.get(), count.bytes());
      queue.for_each(s.table.buckets, pass);
      queue.exclusive_scan(count.get(), start.get(), s.table.buckets + 1, scratch_.scan);
      queue.wait();
      int total = 0;
      start.download_bytes(&total, start.get() + buckets, sizeof total);
      near.resize(static_cast<std::size_t>(total));
      pass.count = nullptr;
      pass.start = start.get();
      pass.near = near.get();
      queue.for_each(s.table.buckets, pass);
    });
    queue.wait();
    s.near_start = start.get();
    s.near = near.get();
  }

  bool rebuilt(std::size_t k) const {
    return !reuses_ && o_.source == SolverOptions::Source::rebuilt && walls_.moves[k] &&
           walls_have_cells();
  }

  FrameWallSource frame_source(const WallSegment& s) const {
    return {wall_from_.get() + s.begin, wall_from_id_.get() + s.begin, walls_.walls.local + s.begin,
            walls_.walls.id + s.begin, wall_room_.get() + s.begin};
  }

  void rebuild_walls(Queue& queue, const Arrays& a) {
    for (std::size_t k = 0; k < walls_.segments.size(); ++k) {
      if (!rebuilt(k)) continue;
      const WallSegment& s = walls_.segments[k];
      const WorldWallSource source{a, walls_.walls, frame_source(s), s.begin, static_cast<int>(k)};
      if (o_.sort == SolverOptions::Sort::counting)
        wall_grids_[k]->counting(queue, s.end - s.begin, source, scratch_);
      else
        wall_grids_[k]->thrust(queue, s.end - s.begin, source, wall_from_id_.get() + s.begin,
                               scratch_);
    }
  }

  template <bool periodic>
  void build(Queue& queue, const Arrays& a, const DeviceGeometry& geometry, const Laps& laps) {
    const FluidSource source = fluid_source(a, geometry);
    if (!sort_fluid_)
      queue.for_each(n_, StayPass{source});
    else if (counts_ahead())
      fluid_.place_counted(queue, n_, source, scratch_);
    else if (o_.sort == SolverOptions::Sort::counting)
      fluid_.counting(queue, n_, source, scratch_);
    else
      fluid_.thrust(queue, n_, source, a.id, scratch_);
    if (watch().trigger == Trigger::local)
      queue.for_each(static_cast<int>(boxes_.size()), ClearBoxes{boxes_.get()});
    rebuild_walls(queue, a);
    if (keeps_pairs()) collect<periodic>(queue, a);
    laps.build();
  }

  /// A hash that sorts by counting counts while it integrates. A sort of walls would write over that.
  bool counts_ahead() const {
    return !reuses_ && o_.sort == SolverOptions::Sort::counting &&
           o_.source == SolverOptions::Source::frame;
  }
  FluidSource fluid_source(const Arrays& a, const DeviceGeometry& geometry) const {
    return {c_,       a, state_, spare_, bucket_.get(), origin_.get(), built_.get(),
            geometry};
  }

  template <bool periodic>
  void collect(Queue& queue, const Arrays& a) {
    const Particles sorted = sort_fluid_ ? spare_ : state_;
    const bool copies = reuses_ && sort_fluid_;
    const Particles to = copies ? state_ : Particles{};
    with_lanes(lanes_, [&](auto lanes) {
      queue.for_each_group<decltype(lanes)::value>(
          n_, CollectPass<periodic>{c_, a, candidates(a), sorted, lists(a), to, origin_.get()});
    });
  }

  Candidates candidates(const Arrays& a) const {
    return {!sort_fluid_, !walls_have_cells(), n_, a.base, fluid_.table(), a.containers,
            segments_.get()};
  }
  /// call(lanes, query) with what passes sum by.
  template <bool periodic, class Call>
  void with_query(const Arrays& a, Call call) const {
    with_lanes(lanes_, [&](auto lanes) {
      if (keeps_pairs())
        call(lanes, list_query<periodic>(a));
      else
        call(lanes, cell_query<periodic>(a));
    });
  }
  template <bool periodic>
  CellQuery<periodic> cell_query(const Arrays& a) const {
    return {{c_, a.base}, candidates(a), a};
  }
  template <bool periodic>
  ListQuery<periodic> list_query(const Arrays& a) const {
    return {{c_, a.base}, lists(a)};
  }
  Lists lists(const Arrays& a) const {
    return {lists_.get(), lanes_, capacity_, a.ghost, counts_.get()};
  }
  /// \param more  another substep follows in the same recording
  Watch watch(Queue& queue, bool more) const {
    if (!reuses_) return {};
    Watch w = watch();
    if (more) w.wake = queue.next_branch();
    return w;
  }
  Watch watch() const {
    const bool automatic = o_.rebuild == 0, local = o_.trigger == SolverOptions::Trigger::local;
    if (!reuses_) return {};
    return {!automatic ? Trigger::every : local && sort_fluid_ ? Trigger::local : Trigger::global,
            o_.rebuild,
            moving_bits(),
            origin_.get(),
            built_.get(),
            fluid_.table(),
            bucket_.get(),
            boxes_.get(),
            fluid_.table().supers(),
            {}};
  }

  void reserve_lists() {
    lists_.resize(0);  // before the larger ones take their room
    if (!keeps_pairs()) return;
    capacity_ = (capacity_ + 3) / 4 * 4;
    lists_.resize(static_cast<std::size_t>(capacity_ / 4 * lanes_) * static_cast<std::size_t>(n_));
    counts_.resize(static_cast<std::size_t>(lanes_) * static_cast<std::size_t>(n_));
  }

  unsigned moving_bits() const {
    unsigned bits = 0;
    for (std::size_t k = 0; k < walls_.moves.size() && k < 32; ++k)
      if (walls_.moves[k]) bits |= 1u << k;
    return bits;
  }
  static void bounds(const std::vector<float>& rows, double low[3], double high[3]) {
    for (std::size_t a = 0; a < 3; ++a) low[a] = high[a] = rows.empty() ? 0 : rows[a];
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const double x = rows[k];
      if (x < low[k % 3]) low[k % 3] = x;
      if (x > high[k % 3]) high[k % 3] = x;
    }
  }

  // Bounds of a skin that is chosen here, and what lists are first made for; shares of H.
  static constexpr double narrowest = 0.08, usual = 0.2, widest = 0.2;

  SolverOptions o_;
  bool reuses_;
  Constants c_{};
  int n_ = 0, lanes_ = 1, capacity_ = 0;
  float reach_ = 0, widest_skin_ = 0;
  bool sort_fluid_ = true;
  WallStore walls_{};
  mutable Particles state_{}, spare_{};
  CellSort fluid_;
  std::vector<std::unique_ptr<CellSort>> wall_grids_;
  mutable SortScratch scratch_;
  Buffer<WallSegment> segments_;
  Buffer<float4> wall_from_, origin_;
  Buffer<int> bucket_, wall_from_id_, counts_;
  Buffer<int2> wall_room_;
  Buffer<int4> lists_;
  std::vector<std::unique_ptr<Buffer<int>>> near_;
  Buffer<DevicePose> built_;
  Buffer<DisplacementBox> boxes_;
  ListVerifier verifier_;
};

/// The two backends made of it.
class HashSearch : public GridSearch {
 public:
  explicit HashSearch(const SolverOptions& options) : GridSearch(options, false) {}
};
class ListSearch : public GridSearch {
 public:
  explicit ListSearch(const SolverOptions& options) : GridSearch(options, true) {}
};

}  // namespace decant::gpu::DECANT_EXECUTOR
