/// \file
/// hash: every substep sorts the fluid into cells, collects the pairs within H from the cells around, and the
/// density and force kernels read them (or, `force_neighbors=recomputed`, both test the cells).
#include "gpu/backends/list_storage.cuh"
#include "gpu/backends/wall_cells.cuh"
#include "gpu/kernels/build_list.cuh"
#include "gpu/kernels/integrate.cuh"
#include "gpu/kernels/sort_sources.cuh"
#include "gpu/solver/solver.cuh"

namespace decant::gpu {
namespace {

class CellList {
 public:
  explicit CellList(const SolverOptions& options) : o_(options) {}

  static constexpr bool stores_square = false, rebuilds_on_demand = false;

  void load(Stream& stream, const Constants& c, const ParticleArrays& a, const WallStore& walls, const Box& region) {
    c_ = c;
    n_ = a.n;
    room_ = a.room;
    walls_ = walls;
#ifdef __CUDACC__
    lanes_ = std::min(o_.threads_per_particle ? o_.threads_per_particle
                      : a.on_ranks()          ? 1  // the only order of sums that does not depend on a rank's share
                      : n_ < 8000             ? 8
                      : n_ < 25000            ? 4
                      : is_large(a.total)     ? 1
                                              : 2,
                      c.any_periodic || !keeps_pairs() ? most_lanes<true> : most_lanes<false>);
#endif
    table_ = {c, region, c.H, is_large(a.total) ? room_ : a.total};
    fluid_.prepare(stream, table_.whole(), room_, scratch_);
    wall_cells_.prepare(stream, c_, a, walls_,
                        {o_.wall_cells == SolverOptions::WallCells::on,
                         o_.moving_walls == SolverOptions::MovingWalls::rebuilt, !is_large(a.total), c.H},
                        scratch_);
    if (!scene_.is(c, a.total, region)) lists_.choose_capacity(o_.capacity, 1, lanes_);
    scene_.set(c, a.total, region);
    if (keeps_pairs()) lists_.reserve(room_, lanes_);
  }
  void set_particles(Stream& stream, int n, const Box& where) {
    n_ = n;
    table_.follow(stream, fluid_, where, room_, scratch_);
  }

  /// Sorting leaves the state in the spare arrays.
  void arrange(ParticleArrays& a) const {
    a.current = a.spare;
    a.next = a.state;
  }
  void begin(Stream& stream, const ParticleArrays& a, const Begin& begin) {
    launch_begin(stream, begin);
    if (!counts_ahead()) return;
    fluid_.clear(stream);
    stream.launch(count_in_cells_kernel<FluidSource>, n_, fluid_.counter(fluid_source(a), scratch_));
  }

  template <bool periodic>
  void find_neighbors(Stream& stream, const ParticleArrays& a, const DeviceGeometry&, Branch) {
    const FluidSource source = fluid_source(a);
    const bool by_counting = o_.sort == SolverOptions::Sort::counting;
    if (counts_ahead()) fluid_.place_counted(stream, n_, source, scratch_);
    else if (by_counting) fluid_.sort_by_counting(stream, n_, source, scratch_);
    else fluid_.sort_by_key(stream, n_, source, a.id, scratch_);
    wall_cells_.rebuild(stream, a, walls_, by_counting, scratch_);
    if (keeps_pairs())
      with_sub_warps<most_lanes<periodic>>(lanes_, [&]<class Team>(std::type_identity<Team>) {
        launch_build_list<Team>(
            stream, n_, BuildList<periodic>{c_, a, candidates(a), a.spare, a.spare.position, lists_.lists(a), {}});
      });
  }

  /// call(type_identity<Team>, range) with what the density and force kernels sum over.
  template <bool periodic, class Call>
  void with_neighbors(const ParticleArrays& a, Call call) const {
    if (keeps_pairs())
      with_sub_warps<most_lanes<periodic>>(
          lanes_, [&](auto team) { call(team, ListNeighbors<periodic>{{c_}, lists_.lists(a)}); });
    else
      with_sub_warps<most_lanes<true>>(lanes_,
                                       [&](auto team) { call(team, CellNeighbors<periodic>{{c_}, candidates(a), a}); });
  }
  /// The same neighbors for one thread per particle.
  template <bool periodic, class Call>
  void with_diagnostic_neighbors(const ParticleArrays& a, Call call) const {
    constexpr std::type_identity<SubWarp<1>> team;
    if (keeps_pairs()) call(team, WholeListNeighbors<periodic>{{c_}, lists_.lists(a)});
    else call(team, CellNeighbors<periodic>{{c_}, candidates(a), a});
  }

  template <bool periodic, class Exchange = NoExchange>
  void integrate(Stream& stream, const ParticleArrays& a, const DeviceGeometry& geometry, Branch,
                 const Exchange& exchange = {}) {
    const auto launch = [&](const auto& after) {
      using After = std::decay_t<decltype(after)>;
      const Integrate<After> integrate{c_, a, geometry, after};
      exchange.start(integrate);
      stream.launch(integrate_kernel<After>, n_ + walls_.moving_count(), integrate, walls_.moving(a));
      exchange.finish(after);
    };
    if (counts_ahead()) launch(CountForNextSort{fluid_.counter(fluid_source(a), scratch_)});
    else launch(NothingElse{});
  }

  /// The ids are in the order of the cells now; so must be the state.
  void restore_state(Stream& stream, const ParticleArrays& a) {
    const auto bytes = static_cast<std::size_t>(n_) * sizeof(float4);
    stream.copy(a.state.position, a.spare.position, bytes);
    stream.copy(a.state.velocity, a.spare.velocity, bytes);
  }

  /// Most of a substep is search, which a persistent kernel does no faster: its blocks share the work less
  /// evenly than many small ones.
  template <bool periodic>
  bool advance(Stream&, const ParticleArrays&, const DeviceGeometry&, int) {
    return false;
  }
  bool capturable() const {
    return o_.launch != SolverOptions::Launch::stream && o_.sort == SolverOptions::Sort::counting;
  }
  bool grow(const DeviceStatus& status) { return lists_.grow(room_, status.longest_list); }
  std::size_t bytes() const { return fluid_.bytes() + wall_cells_.bytes() + scratch_.bytes() + lists_.bytes(); }

 private:
  bool keeps_pairs() const { return o_.force_neighbors == SolverOptions::ForceNeighbors::cached; }
  /// Integration counts for the sort of the next substep. A sort of walls would write over that.
  bool counts_ahead() const {
    return o_.sort == SolverOptions::Sort::counting && o_.moving_walls == SolverOptions::MovingWalls::body_frame;
  }
  FluidSource fluid_source(const ParticleArrays& a) const { return {c_, a, a.state, a.spare, nullptr, nullptr, {}}; }
  Candidates candidates(const ParticleArrays& a) const { return wall_cells_.candidates(a, fluid_.table(), false); }

  SolverOptions o_;
  Constants c_{};
  LoadedScene scene_;
  int n_ = 0, room_ = 0, lanes_ = 1;  // particles, and how many there may be
  WallStore walls_{};
  SceneCells table_;
  CellSort fluid_;
  WallCells wall_cells_;
  SortScratch scratch_;
  ListStorage lists_;
};

}  // namespace

std::unique_ptr<DeviceSolver> DECANT_EXECUTOR::make_hash(const SolverOptions& options) {
  return std::make_unique<Solver<CellList>>(options);
}

}  // namespace decant::gpu
