/// \file
/// A solver from a neighbor search: owns the device arrays and runs the stages of substeps in order, all on the
/// device. Substeps are captured in CUDA graphs where the search allows; one small read-back per `advance` tells
/// of errors.
///
/// A search that finds its lists too short says so in the device status. What was computed since is thrown
/// away: the state before is restored, the lists grow, and the same substeps run again.
#pragma once

#include "gpu/concepts.hpp"
#include "gpu/core/graph.cuh"
#include "gpu/kernels/density.cuh"
#include "gpu/kernels/diagnostics.cuh"
#include "gpu/kernels/force.cuh"
#include "gpu/solver/device_solver.hpp"
#include "gpu/solver/halo.cuh"
#include "gpu/solver/output_buffers.cuh"
#include "gpu/solver/scene_arrays.cuh"
#include "gpu/solver/status_of.cuh"
#include "reference/error.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace decant::gpu {
namespace {

template <NeighborSearch Search>
class Solver : public DeviceSolver {
 public:
  explicit Solver(const SolverOptions& options)
      : search_(options), scene_(Search::stores_square), halo_margin_(options.halo_margin) {}

  void join(Communicator& ranks) override {
    if constexpr (RankSearch<Search>) {
      halo_.emplace(ranks, halo_margin_);
      // A rank that builds its lists when others do not lets them wait, and the other way round.
      stream_.agree_by([&ranks](bool own) { return ranks.any(own); });
    } else {
      DeviceSolver::join(ranks);
    }
  }

  void load(const Problem& problem) override {
    loaded_ = false;             // should anything below fail
    stream_.forget_transfers();  // of a load that failed
    long_graph_.clear();
    short_graph_.clear();
    scene_.load(stream_, problem);
    times_ = {};
    rebuilds_ = advances_ = 0;
    totals_ = {};
    region_ = problem.region;
    if (halo_) halo_->load(problem, scene_);
    search_.load(stream_, c(), arrays(), scene_.walls(), region_);
    stream_.wait();
    in_use_ = Structures::none;
    loaded_ = true;
  }

  Status evaluate(const std::vector<DevicePose>& poses, const GivenInputs& given, HostFields& out) override {
    require_current();
    std::vector<float> own_volume = scene_.boundary_volumes();
    if (!given.boundary_volume.empty()) {
      scene_.forget_walls();  // should anything below fail
      scene_.set_boundary_volumes(given.boundary_volume);
      in_use_ = Structures::none;
    }
    const DeviceStatus status = compute(poses, [&]<bool periodic>(std::bool_constant<periodic>) {
      const OutputArrays fields = output_.unwritten(scene_.particles(), true);
      this->template compute_fields<periodic>(given, fields);
    });
    output_.download(out);
    output_.clear();  // memory that a run does not need
    if (!given.boundary_volume.empty()) scene_.set_boundary_volumes(own_volume);
    out.boundary_volume = std::move(own_volume);
    return agreed_status(status);
  }

  Status evaluate_density(const std::vector<DevicePose>& poses, HostFields& out) override {
    require_current();
    const DeviceStatus status = compute(poses, [&]<bool periodic>(std::bool_constant<periodic>) {
      const ParticleArrays a = arrays();
      find_neighbors<periodic>(a, {});
      compute_density<periodic>(a, output_.unwritten(a.n, false));
      search_.restore_state(stream_, a);
    });
    output_.download(out);
    output_.clear();
    return agreed_status(status);
  }

  Status advance(int substeps, const std::vector<DevicePose>& poses) override {
    require_loaded();
    if (!halo_) return run_part(substeps, poses);
    halo_->begin_advance(stream_, scene_);
    Status status;
    const auto containers = static_cast<std::ptrdiff_t>(poses.size()) / (substeps + 1);
    for (int done = 0; done < substeps && status.ok();) {
      refresh_halo();
      int count = halo_->substeps_to_try(stream_, substeps - done);
      const auto first = poses.begin() + done * containers;
      status = run_part(count, {first, first + (count + 1) * containers});
      if (!status.ok()) status.substep += done;
      done += count;
    }
    return status;
  }

  StateRows read() override { return scene_.read(stream_); }

  StageTimes stage_times() const override { return times_; }
  NeighborStats neighbor_stats() const override {
    NeighborStats stats;
    stats.rebuilds = rebuilds_;
    stats.verified = totals_;
    stats.device_bytes = static_cast<std::int64_t>(scene_.bytes() + search_.bytes() + (halo_ ? halo_->bytes() : 0));
    if (halo_) stats.ranks = halo_->statistics();
    return stats;
  }
  RankRows rank_rows() const override { return halo_ ? halo_->rows(scene_.particles()) : RankRows(); }

 private:
  // Substeps of the long graph: launching it is then cheap beside running it.
  static constexpr int long_graph_substeps = 16;

  /// What an advance left, as it left it: nothing to rely on; lists, counts and walls; the same, with walls placed
  /// for densities and not yet for forces.
  enum class Structures { none, all, walls_for_density };

  /// What a substep has to know beyond the arrays.
  struct SubstepContext {
    bool timed = false;
    Branch rebuild, next_rebuild;  // of this substep and of the one after it in a graph
  };

  const Constants& c() const { return scene_.constants(); }
  void require_loaded() const {
    if (!loaded_) throw BackendError("nothing is loaded");
  }
  /// Loaded, and on ranks with the ghosts that the state needs.
  void require_current() {
    require_loaded();
    if (halo_ && !halo_->fresh()) refresh_halo();
  }
  ParticleArrays arrays() {
    ParticleArrays a = scene_.arrays();
    search_.arrange(a);
    if (halo_) halo_->attach(a);
    return a;
  }
  void upload_poses(const std::vector<DevicePose>& poses) {
    if (!scene_.upload_poses(poses)) return;
    long_graph_.clear();
    short_graph_.clear();
  }

  /// Runs `kernels`, which take periodic as a constant, at the present state and from what an advance left in use.
  template <class Kernels>
  DeviceStatus compute(const std::vector<DevicePose>& poses, Kernels kernels) {
    upload_poses(poses);
    DeviceStatus status;
    do {
      if (in_use_ != Structures::none) resume();
      else begin(false);
      with_periodic(c(), kernels);
      status = status_at_end();
      in_use_ = Structures::none;
    } while (grow(status));
    return status;
  }

  /// All of an advance, or on ranks what may be run with the ghosts that there are: `substeps` is then how many were.
  Status run_part(int& substeps, const std::vector<DevicePose>& poses) {
    upload_poses(poses);
    in_use_ = Structures::none;  // should anything below fail
    DeviceStatus status;
    for (;;) {
      begin(true);
      in_use_ = run(substeps);
      status = status_at_end();
      bool again = grow(status);
      if (halo_ && !again) {
        const int hold = halo_->substeps_that_hold(substeps);
        again = hold < substeps;
        substeps = hold;
      }
      if (!again) break;
      scene_.restore_state(stream_);
    }
    timer_.read();
    rebuilds_ += status.rebuilds;
    add_times(status);
    totals_.pairs += status.pairs;
    totals_.missed += status.pairs_missed;
    totals_.wall_pairs += status.wall_pairs;
    totals_.wall_missed += status.wall_pairs_missed;
    return agreed_status(status);
  }
  void refresh_halo() {
    in_use_ = Structures::none;
    if constexpr (RankSearch<Search>) {
      halo_->refresh(stream_, scene_, [&] { search_.load(stream_, c(), arrays(), scene_.walls(), region_); });
      search_.set_particles(stream_, scene_.particles(), halo_->reach());
    }
  }

  /// One substep: neighbors, density and pressure, forces, motion.
  template <bool periodic>
  void substep(const SubstepContext& context) {
    const ParticleArrays a = arrays();
    if (context.timed) timer_.start(stream_);
    find_neighbors<periodic>(a, context.rebuild);
    lap(context, times_.build);
    compute_density<periodic>(a, {});
    lap(context, times_.density);
    compute_force<periodic>(a, {});
    lap(context, times_.force);
    integrate<periodic>(a, context.next_rebuild);
    lap(context, times_.integrate);
  }
  /// The same kernels, but for the motion, and what they found.
  template <bool periodic>
  void compute_fields(const GivenInputs& given, const OutputArrays& out) {
    const ParticleArrays a = arrays();
    find_neighbors<periodic>(a, {});
    compute_density<periodic>(a, out);
    if (!given.density.empty()) use_given_density(a, given, out.pressure);
    compute_force<periodic>(a, out);
    compute_diagnostics<periodic>(a, out);
    search_.restore_state(stream_, a);
  }

  template <bool periodic>
  void find_neighbors(const ParticleArrays& a, Branch rebuild) {
    const NamedRange range("find neighbors");
    search_.template find_neighbors<periodic>(stream_, a, scene_.geometry(), rebuild);
  }
  template <bool periodic>
  void compute_density(const ParticleArrays& a, const OutputArrays& out) {
    const NamedRange range("density");
    search_.template with_neighbors<periodic>(a, [&]<class Team, NeighborRange<Team> Neighbors>(
                                                     std::type_identity<Team>, const Neighbors& near) {
      stream_.template launch_teams<Team>(density_kernel<Team, Neighbors>, a.n, Density<Neighbors>{c(), a, near, out});
    });
    if (halo_) halo_->exchange_densities(stream_, a);
  }
  template <bool periodic>
  void compute_force(const ParticleArrays& a, const OutputArrays& out) {
    const NamedRange range("force");
    search_.template with_neighbors<periodic>(
        a, [&]<class Team, NeighborRange<Team> Neighbors>(std::type_identity<Team>, const Neighbors& near) {
          stream_.template launch_teams<Team>(force_kernel<Team, Neighbors>, a.n,
                                              Force<Neighbors, StoreAcceleration>{c(), a, near, {a, out}});
        });
  }
  template <bool periodic>
  void integrate(const ParticleArrays& a, Branch next_rebuild) {
    const NamedRange range("integrate");
    if constexpr (RankSearch<Search>)
      if (halo_)
        return search_.template integrate<periodic>(stream_, a, scene_.geometry(), next_rebuild,
                                                    StateExchange{*halo_, stream_, a});
    search_.template integrate<periodic>(stream_, a, scene_.geometry(), next_rebuild);
  }
  template <bool periodic>
  void compute_diagnostics(const ParticleArrays& a, const OutputArrays& out) {
    const NamedRange range("diagnostics");
    const auto launch = [&]<class Team, NeighborRange<Team> Neighbors>(std::type_identity<Team>,
                                                                       const Neighbors& near) {
      stream_.template launch_teams<Team>(neighbor_counts_kernel<Team, Neighbors>, a.n,
                                          NeighborCounts<Neighbors>{c(), a, near, out, scene_.walls().walls.id});
      stream_.template launch_teams<Team>(force_parts_kernel<Team, Neighbors>, a.n,
                                          ForceParts<Neighbors>{c(), a, near, out});
    };
    search_.template with_diagnostic_neighbors<periodic>(a, launch);
  }
  void use_given_density(const ParticleArrays& a, const GivenInputs& given, float* own_pressure) {
    Buffer<float> density(given.density.size()), pressure(given.pressure.size());
    density.upload(given.density);
    pressure.upload(given.pressure);
    stream_.launch(
        use_given_density_kernel, a.n,
        UseGivenDensity{c(), a, density.get(), given.pressure.empty() ? nullptr : pressure.get(), own_pressure});
    stream_.wait();  // the two buffers end here
  }

  void begin(bool keeps_state) {
    const ParticleArrays a = arrays();
    search_.begin(stream_, a, scene_.begin(a, keeps_state));
  }
  /// When all is done that was launched; the read-back waits for it.
  DeviceStatus status_at_end() {
    stream_.run_transfers();
    return scene_.status();
  }

  /// For fields of what the next substep of an advance would use: only what that one would do first is done.
  void resume() {
    DeviceStatus status = scene_.status();
    status.non_finite = status.escaped = status.missed_pair = DeviceStatus::none;
    status.substeps_begun = status.substeps_ended = 0;
    scene_.set_status(status);
    if (in_use_ == Structures::walls_for_density)
      stream_.launch(place_walls_kernel<WallsFor::force>, scene_.walls().moving_count(),
                     scene_.walls().template moving<WallsFor::force>(arrays()));
  }

  /// All at once where the search can; else graph by graph. Now and then the first substep is timed stage by
  /// stage and so is the second, which shares a list with the first, but never of the first advance after a load:
  /// what is compared with the oracle is what runs.
  Structures run(int substeps) {
    Structures left = Structures::all;
    with_periodic(c(), [&](auto periodic) {
      constexpr bool p = decltype(periodic)::value;
      if (search_.template advance<p>(stream_, arrays(), scene_.geometry(), substeps))
        left = Structures::walls_for_density;
      else this->template run_substeps<p>(substeps);
    });
    return left;
  }
  template <bool periodic>
  void run_substeps(int substeps) {
    int done = 0;
    const int sample = advances_++ % 8 == 1 ? 2 : 0;
    // What ranks exchange waits for the host.
    const int timed = search_.capturable() && !halo_ ? std::min(substeps, sample) : substeps;
    for (; done < timed; ++done) {
      substep<periodic>({true, {}, {}});
      // Events are many; reading them now and then keeps their number small.
      if (done % 64 == 63) timer_.read();
    }
    if (substeps - done >= long_graph_substeps && !long_graph_.holds_any())
      long_graph_.hold(stream_, Search::rebuilds_on_demand, [this] {
        Branch rebuild{};
        for (int k = 0; k < long_graph_substeps; ++k) {
          const bool decides = Search::rebuilds_on_demand && k + 1 < long_graph_substeps;
          const Branch next = decides ? stream_.new_branch() : Branch{};
          this->template substep<periodic>({false, rebuild, next});
          rebuild = next;
        }
      });
    for (; substeps - done >= long_graph_substeps; done += long_graph_substeps) long_graph_.launch(stream_);
    if (substeps > done && !short_graph_.holds_any())
      short_graph_.hold(stream_, Search::rebuilds_on_demand, [this] { this->template substep<periodic>({}); });
    for (; done < substeps; ++done) short_graph_.launch(stream_);
  }

  void lap(const SubstepContext& context, StageTimes::Stage& stage) {
    if (context.timed) timer_.lap(stream_, stage);
  }
  /// Of substeps that kept their own time.
  void add_times(const DeviceStatus& status) {
    const auto add = [&](StageTimes::Stage& stage, int k, int calls) {
      if (status.stage_ns[k] <= 0) return;
      stage.seconds += 1e-9 * static_cast<double>(status.stage_ns[k]);
      stage.calls += calls;
    };
    const int substeps = static_cast<int>(status.substeps_ended);
    add(times_.build, 0, status.rebuilds);
    add(times_.density, 1, substeps);
    add(times_.force, 2, substeps);
  }

  /// Whether there was too little room and is more now. Graphs know where the lists were.
  bool grow(const DeviceStatus& status) {
    const bool grown = (status.longest_list != 0 || status.tile_bytes != 0) && search_.grow(status);
    if (grown) {
      long_graph_.clear();
      short_graph_.clear();
    }
    return halo_ ? halo_->ranks().any(grown) : grown;
  }

  Status agreed_status(const DeviceStatus& from) const {
    Status own = status_of(from);
    if (!halo_) return own;
    if (own.particle >= 0) own.particle = halo_->problem_id(own.particle);
    return first_of(halo_->ranks().all(own));
  }

  Stream stream_;
  Search search_;
  SceneArrays scene_;
  double halo_margin_;        // of H
  std::optional<Halo> halo_;  // of one rank of several
  Box region_{};
  OutputBuffers output_;
  bool loaded_ = false;
  Structures in_use_ = Structures::none;
  std::int64_t rebuilds_ = 0, advances_ = 0;
  PairTotals totals_;
  StageTimes times_;
  StageTimer timer_;
  Graph long_graph_, short_graph_;
};

}  // namespace
}  // namespace decant::gpu
