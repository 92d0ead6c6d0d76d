/// \file
/// Whether lists are complete: in every substep the particles are brought into
/// cells as they lie now, apart from everything else, and the pairs within H are counted twice, by
/// those cells and by the lists. Distances are the same expressions of the same bits, so that any
/// difference is a pair that a list lacks.
#pragma once

#include "gpu/kernels/cell_sort.cuh"
#include "gpu/kernels/neighbor_ranges.cuh"

namespace decant::gpu {
namespace {

/// Fluid in the order of its cells of now; nothing else changes.
struct CheckSource {
  ParticleArrays a;
  float4* into;
  int* index;  // where each is in a.current
  int2* room;

  int2* scratch() const { return room; }
  DECANT_DEVICE Float3 position(int i) const { return xyz(a.current.position[i]); }
  DECANT_DEVICE int id(int i) const { return i; }
  DECANT_DEVICE void begin() const {}
  DECANT_DEVICE void place(int i, int, int to, int) const {
    into[to] = a.current.position[i];
    index[to] = i;
  }
};

template <bool periodic>
struct CountMissedPairs {
  Constants c;
  ParticleArrays a;
  Candidates candidates;
  const float4* position;
  const int* index;
  WholeListNeighbors<periodic> listed;
  bool promised;  // a missed pair is an error

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    const int i = team.particle(0);
    if (a.is_ghost(i)) return;
    const Float3 x[1] = {xyz(a.current.position[i])};
    int fluid = 0, wall = 0, fluid_listed = 0, wall_listed = 0;
    candidates.around<periodic>(team.lane(), x[0], a.poses_before(), [&](Candidates::Run run) DECANT_INLINE {
      const bool of_fluid = !run.listed && run.begin < a.base;
      for (int k = run.begin; k < run.end; k += Team::lanes) {
        const int j = run.listed ? run.listed[k] : k;
        const Float3 d = nearest_image<periodic>(c, x[0] - xyz(of_fluid ? position[j] : a.current.position[j]));
        if (!(dot(d, d) < c.H2)) continue;
        if (of_fluid) fluid += index[j] != i;
        else ++wall;
      }
    });
    listed.for_each(team, x, a.current.position, [&](int, int j, float4, Float3, float r2) DECANT_INLINE {
      if (!(r2 < c.H2)) return;
      if (j < a.base) ++fluid_listed;
      else ++wall_listed;
    });
    fluid = team.sum(fluid);
    wall = team.sum(wall);
    fluid_listed = team.sum(fluid_listed);
    wall_listed = team.sum(wall_listed);
    if (!team.is_leader()) return;
    add(&a.status->pairs, fluid);
    add(&a.status->wall_pairs, wall);
    add(&a.status->pairs_missed, fluid - fluid_listed);
    add(&a.status->wall_pairs_missed, wall - wall_listed);
    if (promised && (fluid != fluid_listed || wall != wall_listed))
      report(&a.status->missed_pair, a.status->substeps_ended + 1, a.id[i]);
  }

 private:
  DECANT_DEVICE static void add(long long* to, int value) {
    if (value != 0) atomic_add(to, value);
  }
};

template <class Team, bool periodic>
DECANT_KERNEL(Team::block_size)
count_missed_pairs_kernel(int n, CountMissedPairs<periodic> count) {
  for_each_team<Team>(n, count);
}

/// What it needs beside the lists.
class ListChecker {
 public:
  void prepare(Stream& stream, const CellTable& table, int n, SortScratch& scratch) {
    cells_.prepare(stream, table, n, scratch);
    position_.resize(static_cast<std::size_t>(n));
    index_.resize(static_cast<std::size_t>(n));
    room_.resize(static_cast<std::size_t>(n));
  }
  std::size_t bytes() const { return cells_.bytes() + position_.bytes() + index_.bytes() + room_.bytes(); }

  /// \param around  the candidates that lists are made from; only walls are taken from there
  template <bool periodic>
  void count(Stream& stream, const Constants& c, const ParticleArrays& a, Candidates around,
             const WholeListNeighbors<periodic>& listed, bool promised, SortScratch& scratch) {
    cells_.sort_by_counting(stream, a.n, CheckSource{a, position_.get(), index_.get(), room_.get()}, scratch);
    around.all_fluid = false;
    around.table = cells_.table();
    using Team = SubWarp<1>;
    stream.launch_teams<Team>(
        count_missed_pairs_kernel<Team, periodic>, a.n,
        CountMissedPairs<periodic>{c, a, around, position_.get(), index_.get(), listed, promised});
  }

 private:
  CellSort cells_;
  Buffer<float4> position_;
  Buffer<int> index_;
  Buffer<int2> room_;
};

}  // namespace
}  // namespace decant::gpu
