/// \file
/// list: Verlet lists that reach to H and a skin, rebuilt when a pair could be missed (kernels/rebuild_criterion.cuh)
/// or every N substeps, which the device decides. Below some 300,000 particles all substeps of an advance are one
/// persistent kernel; of small scenes, with `tiles`, lists are in the shared memory of the multiprocessors
/// (kernels/tile_memory.cuh).
#include "gpu/backends/list_storage.cuh"
#include "gpu/backends/tile_storage.cuh"
#include "gpu/backends/wall_cells.cuh"
#include "gpu/kernels/check_lists.cuh"
#include "gpu/kernels/persistent_list.cuh"
#include "gpu/kernels/persistent_tiles.cuh"
#include "gpu/solver/solver.cuh"

namespace decant::gpu {
namespace {

class NeighborList {
 public:
  explicit NeighborList(const SolverOptions& options) : o_(options) {}

  static constexpr bool stores_square = false, rebuilds_on_demand = true;

  void load(Stream& stream, const Constants& c, const ParticleArrays& a, const WallStore& walls, const Box& region) {
    c_ = c;
    n_ = a.n;
    room_ = a.room;
    walls_ = walls;
    const bool at_once = o_.launch == SolverOptions::Launch::automatic && !o_.check_completeness && from_cells() &&
                         criterion() != Criterion::relative && !a.on_ranks();
    tiles_.clear();
    const bool tiled = at_once && wants_tiles() && !c.any_periodic &&
                       (o_.threads_per_particle == 0 || o_.threads_per_particle == TileMemory::lanes) &&
                       tiles_.serve(persistent_tiles_kernel, n_, a.sentinel, a.containers,
                                    (1 + (o_.skin >= 0 ? o_.skin : widest_of_tiles)) * c.H / c.spacing);
    const double skin = o_.skin >= 0 ? o_.skin : tiled ? widest_of_tiles : widest;
    widest_skin_ = static_cast<float>(skin) * c.H;
    const float reach = c.H + widest_skin_;
#ifdef __CUDACC__
    lanes_ = std::min(o_.threads_per_particle ? o_.threads_per_particle
                      : tiled                 ? TileMemory::lanes
                      : n_ < 25000            ? 4
                      : is_large(a.total)     ? 1
                                              : 2,
                      c.any_periodic ? most_lanes<true> : most_lanes<false>);
#endif
    table_ = {c, region, reach, is_large(a.total) ? room_ : a.total};
    const CellTable table = table_.whole();
    fluid_.prepare(stream, table, room_, scratch_);
    if (o_.check_completeness) checker_.prepare(stream, table, room_, scratch_);
    stream.resize(origin_, static_cast<std::size_t>(room_) + read_past_end);
    stream.resize(fastest_, 1);
    if (criterion() == Criterion::relative) {
      bucket_.resize(static_cast<std::size_t>(room_));
      boxes_.resize(2 * static_cast<std::size_t>(table.supers()));
    }
    wall_cells_.prepare(stream, c_, a, walls_, {from_cells(), false, !is_large(a.total), reach}, scratch_);
    if (!scene_.is(c, a.total, region)) lists_.choose_capacity(o_.capacity, 1 + skin, lanes_);
    scene_.set(c, a.total, region);
    lists_.reserve(room_, lanes_);
    persistent_blocks_ = 0;
    if (tiled) tiles_.prepare(stream, fluid_.table());
    if (tiled || !at_once) return;
    with_periodic(c_, [&](auto periodic) {
      constexpr bool p = decltype(periodic)::value;
      this->template with_persistent_lanes<p>([&](auto lanes) {
        persistent_blocks_ =
            persistent_blocks(persistent_list_kernel<decltype(lanes)::value, p>, persistent_shared_bytes());
      });
    });
  }

  void set_particles(Stream& stream, int n, const Box& where) {
    n_ = n;
    if (criterion() != Criterion::relative) table_.follow(stream, fluid_, where, room_, scratch_);
  }

  /// A rebuild copies particles back to where they were, in the new order.
  void arrange(ParticleArrays& a) const { a.current = a.next = a.state; }

  /// The skin of an advance's lists.
  void begin(Stream& stream, const ParticleArrays& a, const Begin& begin) {
    const float least = o_.skin < 0 ? static_cast<float>(narrowest) * c_.H : widest_skin_;
    launch_begin(stream, begin,
                 ChooseSkin{c_, a.state.velocity, fastest_.get(), a.status, least, widest_skin_, o_.rebuild == 0,
                            tiles_.there() ? 6.0f : 0.9f});
  }

  template <bool periodic>
  void find_neighbors(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry, Branch rebuild) {
    stream.when(&a.status->rebuild_needed, rebuild, [&] { this->template rebuild<periodic>(stream, a, geometry); });
    if (o_.check_completeness) check_lists<periodic>(stream, a);
  }

  template <bool periodic, class Call>
  void with_neighbors(const ParticleArrays& a, Call call) const {
    with_sub_warps<most_lanes<periodic>>(lanes_, [&](auto team) { call(team, neighbors<periodic>(a)); });
  }
  template <bool periodic, class Call>
  void with_diagnostic_neighbors(const ParticleArrays& a, Call call) const {
    call(std::type_identity<SubWarp<1>>(), WholeListNeighbors<periodic>{{c_}, lists_.lists(a)});
  }

  template <bool periodic, class Exchange = NoExchange>
  void integrate(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry, Branch next_rebuild,
                 const Exchange& exchange = {}) {
    using Check = CheckDisplacement<periodic>;
    const RebuildCriterion w = rebuild_criterion(next_rebuild);
    const Check check{c_, a, w};
    const Integrate<Check> integrate{c_, a, geometry, check};
    exchange.start(integrate);
    stream.launch(integrate_kernel<Check>, n_ + walls_.moving_count(), integrate, walls_.moving(a));
    exchange.finish(check);
    if (w.criterion == Criterion::relative)
      stream.launch(compare_displacement_boxes_kernel, w.supers, CompareDisplacementBoxes{w, a.status});
  }

  /// It stayed where it is.
  void restore_state(Stream&, const ParticleArrays&) {}

  template <bool periodic>
  bool advance(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry, int substeps) {
    if constexpr (!periodic)
      if (tiles_.there()) {
        advance_tiles(stream, a, geometry, substeps);
        return true;
      }
    tiles_.serve_again();
    if (persistent_blocks_ == 0) return false;
    with_persistent_lanes<periodic>([&](auto lanes) {
      this->template advance_at_once<decltype(lanes)::value, periodic>(stream, a, geometry, substeps);
    });
    return true;
  }
  bool capturable() const { return o_.launch != SolverOptions::Launch::stream; }
  bool grow(const DeviceStatus& status) {
    if (lists_.grow(room_, status.longest_list)) return true;
    return status.tile_bytes != 0 && tiles_.grow(status.tile_bytes);
  }
  std::size_t bytes() const {
    return fluid_.bytes() + wall_cells_.bytes() + scratch_.bytes() + bucket_.bytes() + lists_.bytes() +
           origin_.bytes() + boxes_.bytes() + checker_.bytes() + tiles_.bytes();
  }

 private:
  bool wants_tiles() const {
#ifdef __CUDACC__
    return o_.tiles != SolverOptions::Tiles::off;
#else
    return o_.tiles == SolverOptions::Tiles::on;  // slower: nothing is shared there
#endif
  }
  bool from_cells() const { return o_.build == SolverOptions::Build::grid; }
  Criterion criterion() const {
    if (o_.rebuild != 0) return Criterion::interval;
    return o_.criterion == SolverOptions::Criterion::relative && from_cells() ? Criterion::relative
                                                                              : Criterion::displacement;
  }
  RebuildCriterion rebuild_criterion(Branch next_rebuild) const {
    return {criterion(),   o_.rebuild,   origin_.get(),           fluid_.table(),
            bucket_.get(), boxes_.get(), fluid_.table().supers(), next_rebuild};
  }

  template <bool periodic>
  void rebuild(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry) {
    const FluidSource source = fluid_source(a, geometry);
    if (from_cells()) fluid_.sort_by_counting(stream, n_, source, scratch_);
    else stream.launch(keep_order_kernel, n_, KeepOrder{source});
    if (criterion() == Criterion::relative)
      stream.launch(clear_displacement_boxes_kernel, static_cast<int>(boxes_.size()),
                    ClearDisplacementBoxes{boxes_.get()});
    with_sub_warps<most_lanes<periodic>>(lanes_, [&]<class Team>(std::type_identity<Team>) {
      launch_build_list<Team>(stream, n_, list_build<periodic>(a));
    });
  }
  template <bool periodic>
  BuildList<periodic> list_build(const ParticleArrays& a) const {
    // Sorted particles are copied back; those of all pairs stayed where they are.
    return {c_,
            a,
            candidates(a),
            from_cells() ? a.spare : a.state,
            origin_.get(),
            lists_.lists(a),
            from_cells() ? a.state : Particles{}};
  }
  template <bool periodic>
  void check_lists(Stream& stream, const ParticleArrays& a) {
    checker_.count(stream, c_, a, candidates(a), WholeListNeighbors<periodic>{{c_}, lists_.lists(a)}, o_.rebuild == 0,
                   scratch_);
  }

  /// call(lanes) with the number of lanes as a constant, of those that persistent kernels are compiled for.
  template <bool periodic, class Call>
  void with_persistent_lanes([[maybe_unused]] Call call) const {
#ifdef __CUDACC__
    if constexpr (!periodic)
      if (lanes_ == 4) call(std::integral_constant<int, 4>());
    if (lanes_ == 2) call(std::integral_constant<int, 2>());
#else
    call(std::integral_constant<int, 1>());
#endif
  }
  void advance_tiles(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry, int substeps) {
    const FluidSource source = fluid_source(a, geometry);
    const TileOrder order = tiles_.order(fluid_.table());
    const BlockMemory memory = tiles_.memory();
    launch_persistent(stream, persistent_tiles_kernel, memory.blocks, static_cast<std::size_t>(memory.bytes), substeps,
                      TileSubstep{n_,
                                  walls_.moving_count(),
                                  a.status,
                                  walls_.moving<WallsFor::density>(a),
                                  source,
                                  sort(source),
                                  order,
                                  TileOrder::rows(fluid_.table()),
                                  fluid_.order(TiledFluidSource{source, order}, scratch_),
                                  {{c_, a, lists_.lists(a), walls_.walls, walls_.first_moving, walls_.moving_end,
                                    origin_.get(), order.particle, tiles_.terms(), memory}},
                                  {c_, a, geometry, {c_, a, rebuild_criterion({})}}});
  }
  std::size_t persistent_shared_bytes() const { return BuildList<false>::shared_bytes(lanes_, persistent_block); }
  template <int lanes, bool periodic>
  void advance_at_once(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry, int substeps) {
    const FluidSource source = fluid_source(a, geometry);
    const ListNeighbors<periodic> listed = neighbors<periodic>(a);
    const CheckDisplacement<periodic> check{c_, a, rebuild_criterion({})};
    launch_persistent(stream, persistent_list_kernel<lanes, periodic>, persistent_blocks_, persistent_shared_bytes(),
                      substeps,
                      ListSubstep<periodic>{n_,
                                            walls_.moving_count(),
                                            a.status,
                                            sort(source),
                                            fluid_.order(source, scratch_),
                                            list_build<periodic>(a),
                                            {c_, a, listed, {}},
                                            walls_.moving<WallsFor::force>(a),
                                            {c_, a, listed, {c_, a, geometry, check}},
                                            walls_.moving<WallsFor::density>(a)});
  }

  PersistentSort<FluidSource> sort(const FluidSource& source) {
    return {n_,
            fluid_.counter(source, scratch_),
            fluid_.counts(),
            fluid_.starts(),
            fluid_.table().buckets + 1,
            reinterpret_cast<int*>(scratch_.scan.get()),
            fluid_.scatter(source, scratch_)};
  }
  FluidSource fluid_source(const ParticleArrays& a, const DeviceGeometry& geometry) const {
    return {c_, a, a.state, a.spare, bucket_.get(), origin_.get(), geometry};
  }
  Candidates candidates(const ParticleArrays& a) const {
    return wall_cells_.candidates(a, fluid_.table(), !from_cells());
  }
  template <bool periodic>
  ListNeighbors<periodic> neighbors(const ParticleArrays& a) const {
    return {{c_}, lists_.lists(a)};
  }

  // Bounds of a skin that is chosen here, shares of H; lists are first made for the widest.
  static constexpr double narrowest = 0.06, widest = 0.2, widest_of_tiles = 0.4;

  SolverOptions o_;
  Constants c_{};
  LoadedScene scene_;
  int n_ = 0, room_ = 0, lanes_ = 1;  // particles, and how many there may be
  int persistent_blocks_ = 0;         // 0: substep by substep
  float widest_skin_ = 0;             // m
  WallStore walls_{};
  SceneCells table_;
  CellSort fluid_;
  WallCells wall_cells_;
  SortScratch scratch_;
  ListStorage lists_;
  TileStorage tiles_;
  Buffer<float4> origin_;
  Buffer<int> bucket_, fastest_;
  Buffer<DisplacementBox> boxes_;
  ListChecker checker_;
};

}  // namespace

std::unique_ptr<DeviceSolver> DECANT_EXECUTOR::make_list(const SolverOptions& options) {
  return std::make_unique<Solver<NeighborList>>(options);
}

}  // namespace decant::gpu
