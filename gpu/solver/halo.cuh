/// \file
/// A rank's ghosts: copies of other ranks' particles that may come within H of its own. Which they are is decided by
/// place, with a margin, and holds until a particle has moved by half of it; migration and the ranks' boxes change
/// at the same moments only. Between them every substep exchanges the same particles.
///
/// How far particles move is known when they have moved. So a number of substeps is tried, and where that was too
/// many for the margin, the state is restored and fewer are run. No result depends on any of this.
#pragma once

#include "gpu/kernels/cell_sort.cuh"
#include "gpu/kernels/exchange.cuh"
#include "gpu/kernels/integrate.cuh"
#include "gpu/kernels/migrate.cuh"
#include "gpu/ranks/transport.cuh"
#include "gpu/solver/decomposition.cuh"
#include "gpu/solver/scene_arrays.cuh"
#include "reference/error.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numeric>

namespace decant::gpu {
namespace {

class Halo {
 public:
  /// \param margin  of H; negative: by the speed of the fastest particle
  Halo(Communicator& ranks, double margin)
      : ranks_(ranks), transport_(ranks), decomposition_(ranks, static_cast<float>(margin)) {}

  Communicator& ranks() const { return ranks_; }
  bool fresh() const { return fresh_; }
  /// Where a rank's own particles and ghosts are.
  const Box& reach() const { return decomposition_.reach(); }
  const RankStats& statistics() const { return statistics_; }

  void load(const Problem& problem, const SceneArrays& scene) {
    fresh_ = false;
    statistics_ = {};
    reserve(scene.room());
    global_id_.upload(problem.id);
    role_.upload(std::vector<ParticleRole>(problem.id.size(), ParticleRole::interior));
    decomposition_.load(problem);
  }

  void attach(ParticleArrays& a) const {
    a.global_id = global_id_.get();
    a.role = role_.get();
    a.index = index_.get();
    a.farthest = farthest_.get();
    a.reach = decomposition_.walls_within();
  }

  /// Brings every particle to the ranks that need it. `reload` is called where there is more room afterwards.
  template <class Reload>
  void refresh(Stream& stream, SceneArrays& scene, Reload reload) {
    if (statistics_.migrations > 0) {
      const double now = imbalance({owned_.begin(), owned_.end()});
      statistics_.largest_imbalance = std::max(statistics_.largest_imbalance, now);
      if (now > most_imbalance) survey(stream, scene);
    }
    const int kept = assign(stream, scene);
    const std::vector<int> departing = counts(departing_);
    const std::vector<int> arriving = transposed(departing);
    const int arrivals = std::accumulate(arriving.begin(), arriving.end(), 0);
    if (kept + arrivals > scene.room()) {
      scene.grow(stream, kept + arrivals + (kept + arrivals) / 50 + tile_size);
      global_id_.grow(static_cast<std::size_t>(scene.room()), static_cast<std::size_t>(scene.particles()));
      role_.grow(static_cast<std::size_t>(scene.room()), static_cast<std::size_t>(scene.particles()));
      reserve(scene.room());
      reload();
      assign(stream, scene);
    }
    migrate(stream, scene, departing, arriving, kept);
    number(stream, scene, kept + arrivals);
    fresh_ = true;
    ++statistics_.migrations;
  }

  /// Before an advance: boxes, and how far particles will move, are those of the state and of nothing before, so that
  /// a resumed pour does what an uninterrupted one does.
  void begin_advance(Stream& stream, SceneArrays& scene) {
    most_substeps_ = first_substeps;
    survey(stream, scene);
  }

  /// How many substeps may be tried, of so many that are wanted.
  int substeps_to_try(Stream& stream, int wanted) {
    const double fit = decomposition_.substeps_that_fit();
    const int count = static_cast<int>(std::clamp<double>(fit, 1, std::min(wanted, most_substeps_)));
    farthest_.reserve(static_cast<std::size_t>(count));
    stream.fill_zero(farthest_.get(), static_cast<std::size_t>(count) * sizeof(int));
    return count;
  }
  /// How many of `count` substeps were run with all ghosts that they needed.
  int substeps_that_hold(int count) {
    const auto n = static_cast<std::size_t>(count);
    std::vector<int> own = farthest_.download(n), all(n * static_cast<std::size_t>(ranks_.size()));
    ranks_.all_gather(own.data(), n * sizeof(int), all.data());
    double way = 0, step = 0;
    int hold = 1;
    for (std::size_t s = 0; s < n; ++s) {
      int bits = 0;
      for (std::size_t r = 0; r < static_cast<std::size_t>(ranks_.size()); ++r) bits = std::max(bits, all[r * n + s]);
      step = std::sqrt(unordered(bits));
      way += step;
      fresh_ = way <= 0.5 * decomposition_.margin();
      if (!fresh_ || s + 1 == n) break;
      hold = static_cast<int>(s) + 2;
    }
    decomposition_.note_step(step);
    most_substeps_ = std::clamp(2 * hold, first_substeps, most_tried);
    return hold;
  }

  void exchange_densities(Stream& stream, const ParticleArrays& a) {
    auto *out = reinterpret_cast<DensityTerms*>(out_.get()), *in = reinterpret_cast<DensityTerms*>(in_.get());
    stream.launch(pack_densities_kernel, sum(sends_), PackDensities{a, send_.get(), out});
    exchange(stream, out, in);
    stream.launch(unpack_densities_kernel, sum(receives_), UnpackDensities{a, receive_.get(), in});
  }
  /// Moves what other ranks have copies of and sends it; whatever is launched before `finish` runs meanwhile.
  template <class Integrate>
  void start_states(Stream& stream, const ParticleArrays& a, const Integrate& integrate) {
    stream.launch(integrate_border_kernel<decltype(integrate.after)>, borders_, border_.get(), integrate);
    stream.launch(pack_states_kernel, sum(sends_), PackStates{a, send_.get(), out_.get()});
    transport_.start(stream, segments(out_.get(), sends_), segments(in_.get(), receives_));
  }
  /// \param after  Integrate::after
  template <class After>
  void finish_states(Stream& stream, const ParticleArrays& a, const After& after) {
    transport_.finish(stream);
    stream.launch(unpack_states_kernel<After>, sum(receives_),
                  UnpackStates<After>{a, receive_.get(), in_.get(), after});
  }

  RankRows rows(int n) const {
    RankRows rows{global_id_.download(static_cast<std::size_t>(n)), {}};
    for (const ParticleRole role : role_.download(static_cast<std::size_t>(n)))
      rows.owned.push_back(role == ParticleRole::ghost ? 0 : 1);
    return rows;
  }
  /// The problem's id of one of this rank's.
  std::int64_t problem_id(std::int64_t id) const {
    int global = -1;
    if (id >= 0 && id < static_cast<std::int64_t>(global_id_.size()))
      global_id_.download_bytes(&global, global_id_.get() + id, sizeof global);
    return global;
  }
  std::size_t bytes() const {
    return global_id_.bytes() + role_.bytes() + border_.bytes() + index_.bytes() + farthest_.bytes() + send_.bytes() +
           receive_.bytes() + 3 * spare_[0].bytes() + scan_.bytes() + sort_.bytes() + travellers_out_.bytes() +
           travellers_in_.bytes() + out_.bytes() + in_.bytes();
  }

 private:
  static constexpr int first_substeps = 64, most_tried = 256;
  static constexpr double most_imbalance = 1.08;

  int count() const { return ranks_.size(); }
  static int sum(const std::vector<int>& values) { return std::accumulate(values.begin(), values.end(), 0); }
  std::vector<int> counts(const Buffer<int>& from) const { return from.download(static_cast<std::size_t>(count())); }

  void reserve(int room) {
    const auto n = static_cast<std::size_t>(room);
    for (Buffer<int>* each : {&global_id_, &index_})
      if (each->size() < n) each->resize(n);
    if (role_.size() < n) role_.resize(n);
    for (Buffer<int>* each :
         {&departing_, &gone_, &first_, &sends_counted_, &receives_counted_, &first_send_, &first_receive_})
      each->resize(most_ranks);
    bordering_.resize(1);
    damaged_.resize(1);
  }
  /// What each other rank has for this one, where `own` is what this one has for each.
  std::vector<int> transposed(const std::vector<int>& own) const {
    const auto n = static_cast<std::size_t>(count());
    std::vector<int> all(n * n), to_here(n);
    ranks_.all_gather(own.data(), n * sizeof(int), all.data());
    for (std::size_t r = 0; r < n; ++r) to_here[r] = all[r * n + static_cast<std::size_t>(ranks_.rank())];
    return to_here;
  }

  ParticleArrays arrays(SceneArrays& scene) const {
    ParticleArrays a = scene.arrays();
    attach(a);
    return a;
  }
  static void zero(Stream& stream, std::initializer_list<Buffer<int>*> buffers) {
    for (Buffer<int>* each : buffers) stream.fill_zero(each->get(), each->bytes());
  }
  void survey(Stream& stream, SceneArrays& scene) {
    decomposition_.survey(stream, scene.constants(), arrays(scene));
    ++statistics_.rebalances;
  }

  // Memory that is free between advances: what the kernels of a substep write first. Four arrays of ints fit into
  // one of positions.
  static Registration* before(const ParticleArrays& a) { return reinterpret_cast<Registration*>(a.force_position); }
  static Registration* after(const SceneArrays& scene) { return static_cast<Registration*>(scene.scratch()); }
  static int* ints(const ParticleArrays& a, int k) {
    return reinterpret_cast<int*>(a.force_velocity) + k * (padded(a.room) + SortScratch::scan_padding);
  }
  static_assert(4 * SortScratch::scan_padding <= 4 * read_past_end);

  /// Who needs which particle; how many stay.
  int assign(Stream& stream, SceneArrays& scene) {
    const ParticleArrays a = arrays(scene);
    const int n = a.n;
    stream.fill_zero(departing_.get(), departing_.bytes());
    stream.fill_zero(ints(a, 0) + n, SortScratch::scan_padding * sizeof(int));
    stream.launch(assign_ranks_kernel, n,
                  AssignRanks{scene.constants(), a, decomposition_.boxes(), before(a), ints(a, 0), departing_.get()});
    Stream::reserve_scan(n + 1, scan_);
    stream.exclusive_scan(ints(a, 0), ints(a, 1), n + 1, scan_);
    stream.wait();
    int stay = 0;
    copy_to_host(&stay, ints(a, 1) + n, sizeof stay);
    return stay;
  }

  void migrate(Stream& stream, SceneArrays& scene, const std::vector<int>& departing, const std::vector<int>& arriving,
               int kept) {
    const ParticleArrays a = arrays(scene);
    travellers_out_.reserve(static_cast<std::size_t>(sum(departing)));
    travellers_in_.reserve(static_cast<std::size_t>(sum(arriving)));
    first_.upload(starts(departing));
    stream.fill_zero(gone_.get(), gone_.bytes());
    stream.launch(depart_kernel, a.n,
                  Depart{a, decomposition_.boxes(), before(a), ints(a, 0), ints(a, 1), first_.get(), gone_.get(),
                         after(scene), travellers_out_.get()});
    transport_.exchange(stream, segments(travellers_out_.get(), departing), segments(travellers_in_.get(), arriving));
    stream.launch(arrive_kernel, sum(arriving), Arrive{a, travellers_in_.get(), kept, after(scene)});
    const auto bytes = static_cast<std::size_t>(kept + sum(arriving)) * sizeof(float4);
    stream.copy(a.state.position, a.spare.position, bytes);
    stream.copy(a.state.velocity, a.spare.velocity, bytes);
  }

  void number(Stream& stream, SceneArrays& scene, int n) {
    scene.set_particles(n);
    const ParticleArrays a = arrays(scene);
    zero(stream, {&sends_counted_, &receives_counted_, &bordering_, &damaged_});
    stream.launch(count_exchanged_kernel, n,
                  CountExchanged{decomposition_.boxes(), after(scene), sends_counted_.get(), receives_counted_.get(),
                                 bordering_.get(), damaged_.get(), ints(a, 0), ints(a, 2)});
    Pairs pairs{ints(a, 0), ints(a, 1), ints(a, 2), ints(a, 3)};
    stream.sort_pairs(pairs, n, bits_below(a.total), sort_);
    stream.wait();
    sends_ = counts(sends_counted_);
    receives_ = counts(receives_counted_);
    borders_ = bordering_.download(1)[0];
    statistics_.ghosts = sum(receives_);
    owned_ = ranks_.all(n - sum(receives_));
    check(a.total);
    reserve_exchange();
    zero(stream, {&sends_counted_, &receives_counted_, &bordering_});
    stream.launch(
        number_by_id_kernel, n,
        NumberById{a, decomposition_.boxes(), after(scene), pairs.key, pairs.value, global_id_.get(), role_.get(),
                   first_send_.get(), first_receive_.get(), sends_counted_.get(), receives_counted_.get(), send_.get(),
                   receive_.get(), bordering_.get(), border_.get(), damaged_.get()});
    sort_parts(stream, send_, sends_, n);
    sort_parts(stream, receive_, receives_, n);
    stream.wait();
    check_damage();
  }
  void reserve_exchange() {
    const auto out = static_cast<std::size_t>(sum(sends_)), in = static_cast<std::size_t>(sum(receives_));
    send_.reserve(out);
    receive_.reserve(in);
    for (Buffer<int>& spare : spare_) spare.reserve(std::max(out, in));
    border_.reserve(static_cast<std::size_t>(borders_));
    out_.reserve(out);
    in_.reserve(in);
    first_send_.upload(starts(sends_));
    first_receive_.upload(starts(receives_));
  }
  /// That nothing was lost on the way or came twice, and that both sides expect the same.
  void check(int total) const {
    check_damage();
    const std::int64_t owned = std::accumulate(owned_.begin(), owned_.end(), std::int64_t{0});
    if (owned != total)
      throw BackendError("after a migration the ranks own " + std::to_string(owned) + " of " + std::to_string(total) +
                         " particles");
    const std::vector<int> expected = transposed(sends_);
    for (int r = 0; r < count(); ++r)
      if (const auto k = static_cast<std::size_t>(r); expected[k] != receives_[k])
        throw BackendError("rank " + std::to_string(r) + " sends " + std::to_string(expected[k]) + " ghosts to rank " +
                           std::to_string(ranks_.rank()) + ", which expects " + std::to_string(receives_[k]));
  }
  void check_damage() const {
    for (const int damaged : ranks_.all(damaged_.download(1)[0]))
      if (damaged != 0)
        throw BackendError("a rank has " + std::to_string(damaged) +
                           " particles after a migration that came twice or in part");
  }
  void sort_parts(Stream& stream, const Buffer<int>& list, const std::vector<int>& parts, int n) {
    int first = 0;
    for (const int part : parts) {
      int* const at = list.get() + first;
      Pairs pairs{at, spare_[0].get(), spare_[1].get(), spare_[2].get()};
      if (part > 1) stream.sort_pairs(pairs, part, bits_below(n), sort_);
      if (pairs.key != at) stream.copy(at, pairs.key, static_cast<std::size_t>(part) * sizeof(int));
      first += part;
    }
  }
  /// Bits that numbers below n have.
  static int bits_below(int n) {
    int bits = 1;
    while (bits < 31 && (1 << bits) < n) ++bits;
    return bits;
  }
  static std::vector<int> starts(const std::vector<int>& parts) {
    std::vector<int> first(parts.size());
    std::exclusive_scan(parts.begin(), parts.end(), first.begin(), 0);
    return first;
  }
  template <class T>
  static std::vector<Segment> segments(T* at, const std::vector<int>& parts) {
    std::vector<Segment> out;
    for (const int part : parts) {
      out.push_back({at, static_cast<std::size_t>(part) * sizeof(T)});
      at += part;
    }
    return out;
  }
  template <class T>
  void exchange(Stream& stream, T* out, T* in) {
    transport_.exchange(stream, segments(out, sends_), segments(in, receives_));
  }

  Communicator& ranks_;
  Transport transport_;
  Decomposition decomposition_;
  bool fresh_ = false;  // the ghosts that there are suffice for the state that there is
  int most_substeps_ = first_substeps;
  RankStats statistics_;
  std::vector<int> owned_;  // by rank, particles
  Buffer<int> global_id_, index_, farthest_;
  Buffer<ParticleRole> role_;
  Buffer<int> border_;  // own particles that others have copies of
  int borders_ = 0;     // how many
  Buffer<char> scan_, sort_;
  Buffer<int> departing_, gone_, first_, sends_counted_, receives_counted_, bordering_, damaged_, first_send_,
      first_receive_;
  Buffer<Traveller> travellers_out_, travellers_in_;
  std::vector<int> sends_, receives_;  // by rank, particles per substep
  Buffer<int> send_, receive_, spare_[3];
  Buffer<GhostState> out_, in_;
};

/// For a search's integration (NoExchange).
struct StateExchange {
  Halo& halo;
  Stream& stream;
  const ParticleArrays& a;

  template <class Integrate>
  void start(const Integrate& integrate) const {
    halo.start_states(stream, a, integrate);
  }
  template <class After>
  void finish(const After& after) const {
    halo.finish_states(stream, a, after);
  }
};

}  // namespace
}  // namespace decant::gpu
