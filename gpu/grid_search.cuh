/// \file
/// The spatial hash and the neighbor lists: one search, because a hash that remembers its pairs for
/// the force pass is a list rebuilt every substep, and a list is a hash that is not rebuilt yet.
///
/// hash: every substep sorts the fluid into cells; the density pass tests the cells around and writes
/// what it finds into lists for the force pass (or, `force_neighbors=recomputed`, the force pass tests cells again).
/// list: lists reach to H and a skin; the sort and the lists are made when a trigger asks for it,
/// decided on the device.
#pragma once

#include "gpu/collect.cuh"
#include "gpu/crew.cuh"
#include "gpu/pipeline.cuh"
#include "gpu/verify.cuh"
#include "gpu/wall_grids.cuh"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace decant::gpu::DECANT_EXECUTOR {

class GridSearch {
 public:
  GridSearch(const SolverOptions& options, bool reuses) : o_(options), reuses_(reuses) {}

  static constexpr bool points_carry_square = false;

  void load(Queue& queue, const Constants& c, const Arrays& a, const WallStore& walls,
            const Box& region) {
    // The same scene over again keeps the room that it is known to need.
    const bool again = n_ == a.n && c_.H == c.H && std::memcmp(&region_, &region, sizeof region) == 0;
    c_ = c;
    n_ = a.n;
    region_ = region;
    walls_ = walls;
    widest_skin_ = !reuses_ ? 0.0f : static_cast<float>(o_.skin < 0 ? widest : o_.skin) * c.H;
    reach_ = c.H + widest_skin_;
#ifdef __CUDACC__
    lanes_ = o_.lanes ? o_.lanes : fitting_lanes();
#endif
    sort_fluid_ = !(reuses_ && o_.build == SolverOptions::Build::all_pairs);
    prepare_fluid(queue, region);
    grids_.prepare(queue, c_, a, walls_,
                   {walls_have_cells(), !reuses_ && o_.source == SolverOptions::Source::rebuilt,
                    !large(), reach_},
                   scratch_);
    if (!again) {
      // Whatever was loaded before: a run has the lists that its own problem makes it have.
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
    const bool ahead = o_.rebuild == 0;
    if (o_.skin < 0 || ahead) queue.for_each(n_, FastestPass{a, state_.velocity});
    const float least = o_.skin < 0 ? static_cast<float>(narrowest) * c_.H : widest_skin_;
    queue.for_each(1, SkinPass{c_, a.mailbox, least, widest_skin_, ahead});
  }
  bool capturable() const {
    return o_.launch != SolverOptions::Launch::plain && o_.sort == SolverOptions::Sort::counting;
  }
  /// All of an advance in one launch, where that pays and the device can. A hash, of which most is
  /// search, is no faster so: a crew's blocks share the work less evenly than many small ones.
  template <bool periodic>
  bool advance(Queue& queue, const Arrays& a, const DeviceGeometry& geometry, int substeps) {
    if (!reuses_ || o_.launch != SolverOptions::Launch::automatic || o_.verify || !sort_fluid_ ||
        watch().trigger == Trigger::local)
      return false;
    bool done = false;
    with_crew_lanes([&](auto lanes) {
      done = repeat_substep<decltype(lanes)::value, periodic>(queue, a, geometry, substeps);
    });
    return done;
  }

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
      queue.for_each_group<decltype(lanes)::value>(n_, Pass{c_, a, query, out, {a}});
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
      queue.for_each(n_ + walls_.moving_count(), Pass{{c_, a, geometry, after}, walls_.moving(a)});
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
    return fluid_.bytes() + grids_.bytes() + scratch_.bytes() + bucket_.bytes() + lists_.bytes() +
           counts_.bytes() + origin_.bytes() + boxes_.bytes() + verifier_.bytes();
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

  /// The order of sums is that of the cells. So that it depends on the state at hand alone and not on one
  /// that was once loaded, which a resumed pour does not know, the table is the scene's.
  void prepare_fluid(Queue& queue, const Box& region) {
    const double low[3] = {region.min.x, region.min.y, region.min.z};
    double high[3] = {region.max.x, region.max.y, region.max.z};
    for (int a = 0; a < 3; ++a) {
      // What falls out of a cup stays within a few times its size, if it stays in the domain.
      const double most = high[a] - low[a] + 16.0 * reach_;
      const double domain = double(c_.domain_max[a]) - c_.domain_min[a];
      high[a] = low[a] + std::min(most, domain);
    }
    const CellTable table =
        make_cell_table(c_, reach_, low, high, std::max(4096.0, (large() ? 2.5 : 5.0) * n_));
    fluid_.prepare(queue, table, n_, scratch_);
    if (!reuses_) return;
    if (o_.verify) verifier_.prepare(queue, table, n_, scratch_);
    origin_.resize(static_cast<std::size_t>(n_) + read_past);
    if (watch().trigger != Trigger::local) return;
    bucket_.resize(static_cast<std::size_t>(n_));
    boxes_.resize(2 * static_cast<std::size_t>(table.supers()));
  }

  template <bool periodic>
  void build(Queue& queue, const Arrays& a, const DeviceGeometry& geometry, const Laps& laps) {
    const FluidSource source = fluid_source(a, geometry);
    if (!sort_fluid_)
      queue.for_each(n_, StayPass{source});
    else if (counts_ahead())
      start(queue, fluid_.place_counted(n_, source, scratch_));
    else if (o_.sort == SolverOptions::Sort::counting)
      fluid_.counting(queue, n_, source, scratch_);
    else
      fluid_.thrust(queue, n_, source, a.id, scratch_);
    if (watch().trigger == Trigger::local)
      queue.for_each(static_cast<int>(boxes_.size()), ClearBoxes{boxes_.get()});
    grids_.rebuild(queue, a, walls_, o_.sort == SolverOptions::Sort::counting, scratch_);
    if (keeps_pairs())
      with_lanes(lanes_, [&](auto lanes) {
        start(queue, collect<decltype(lanes)::value, periodic>(a));
      });
    laps.build();
  }

  /// A hash that sorts by counting counts while it integrates. A sort of walls would write over that.
  bool counts_ahead() const {
    return !reuses_ && o_.sort == SolverOptions::Sort::counting &&
           o_.source == SolverOptions::Source::frame;
  }
  FluidSource fluid_source(const Arrays& a, const DeviceGeometry& geometry) const {
    return {c_, a, state_, spare_, bucket_.get(), origin_.get(), geometry};
  }

  template <int lanes, bool periodic>
  auto collect(const Arrays& a) const {
    const Particles sorted = sort_fluid_ ? spare_ : state_;
    const Particles to = reuses_ && sort_fluid_ ? state_ : Particles{};
    return each_group<lanes>(n_,
                             CollectPass<periodic>{c_, a, candidates(a), sorted,
                                                   reuses_ ? origin_.get() : sorted.position,
                                                   lists(a), to});
  }

  /// The number of lanes as a constant, of those that crews are made for.
  template <class Call>
  void with_crew_lanes([[maybe_unused]] Call call) const {
#ifdef __CUDACC__
    if (lanes_ == 4) call(std::integral_constant<int, 4>());
    if (lanes_ == 2) call(std::integral_constant<int, 2>());
#else
    call(std::integral_constant<int, 1>());
#endif
  }
  template <int lanes, bool periodic>
  bool repeat_substep(Queue& queue, const Arrays& a, const DeviceGeometry& geometry, int substeps) {
    using Query = ListQuery<periodic>;
    using After = WatchParticle<periodic>;
    const Query query = list_query<periodic>(a);
    const FluidSource source = fluid_source(a, geometry);
    const int moving = walls_.moving_count();
    const auto density =
        Beside<EachGroup<lanes, DensityPass<Query, false>>, Each<PlaceWallsPass<PlacedFor::force>>>{
            {n_, {c_, a, query, {}, walls_.walls.id}},
            {moving, walls_.moving<PlacedFor::force>(a)}};
    const auto move = Beside<EachGroup<lanes, ForcePass<Query, false, Mover<After>>>,
                             Each<PlaceWallsPass<PlacedFor::density>>>{
        {n_, {c_, a, query, {}, {c_, a, geometry, {c_, a, watch()}}}},
        {moving, walls_.moving<PlacedFor::density>(a)}};
    const auto build = in_order(fluid_.count(n_, source, scratch_),
                                fluid_.place_counted(n_, source, scratch_),
                                collect<lanes, periodic>(a));
    using Whole = Substep<std::decay_t<decltype(build)>, std::decay_t<decltype(density)>,
                          std::decay_t<decltype(move)>>;
    return repeat(queue, substeps,
                  Whole{&a.mailbox->stale, build, density, move, a.mailbox->stage_ns});
  }

  Candidates candidates(const Arrays& a) const {
    return grids_.candidates(a, fluid_.table(), !sort_fluid_);
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
    return {{c_}, candidates(a), a};
  }
  template <bool periodic>
  ListQuery<periodic> list_query(const Arrays& a) const {
    return {{c_}, lists(a)};
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
            origin_.get(),
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
    const std::size_t threads = static_cast<std::size_t>(lanes_) * static_cast<std::size_t>(n_);
    lists_.resize(Lists::room(threads, capacity_));
    counts_.resize(threads);
  }

  // Bounds of a skin that is chosen here, and what lists are first made for; shares of H.
  static constexpr double narrowest = 0.06, usual = 0.2, widest = 0.2;

  SolverOptions o_;
  bool reuses_;
  Constants c_{};
  Box region_{};
  int n_ = 0, lanes_ = 1, capacity_ = 0;
  float reach_ = 0, widest_skin_ = 0;
  bool sort_fluid_ = true;
  WallStore walls_{};
  mutable Particles state_{}, spare_{};
  CellSort fluid_;
  WallGrids grids_;
  mutable SortScratch scratch_;
  Buffer<float4> origin_;
  Buffer<int> bucket_, counts_;
  Buffer<int4> lists_;
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
