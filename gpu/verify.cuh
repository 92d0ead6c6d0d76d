/// \file
/// Whether lists hold all pairs, asked of themselves: in every substep the particles are brought into
/// cells as they lie now, apart from everything else, and the pairs within H are counted twice, by
/// those cells and by the lists. Distances are the same expressions of the same bits, so that any
/// difference is a pair that a list lacks.
#pragma once

#include "gpu/queries.cuh"
#include "gpu/sort.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// Fluid in the order of its cells of now; nothing else changes.
struct VerifySource {
  Arrays a;
  float4* into;
  int* index;  // where each is in a.now
  int2* room;

  int2* desk() const { return room; }
  DECANT_DEVICE Float3 position(int i) const { return xyz(a.now.position[i]); }
  DECANT_DEVICE int id(int i) const { return i; }
  DECANT_DEVICE void begin() const {}
  DECANT_DEVICE void place(int i, int, int to, int) const {
    into[to] = a.now.position[i];
    index[to] = i;
  }
};

template <bool periodic>
struct VerifyPass {
  Constants c;
  Arrays a;
  Candidates candidates;
  const float4* position;
  const int* index;
  ListQuery<periodic> listed;
  bool promised;  // a missed pair is trouble

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    const int i = team.particle(0);
    const Float3 x[1] = {xyz(a.now.position[i])};
    int fluid = 0, wall = 0, fluid_listed = 0, wall_listed = 0;
    candidates.around<periodic>(team.lane(), x[0], a.poses_before(),
                                [&](Candidates::Run run) DECANT_INLINE {
      const bool of_fluid = !run.listed && run.begin < a.base;
      for (int k = run.begin; k < run.end; k += Team::lanes) {
        const int j = run.listed ? run.listed[k] : k;
        const Float3 d =
            nearest_image<periodic>(c, x[0] - xyz(of_fluid ? position[j] : a.now.position[j]));
        if (!(dot(d, d) < c.H2)) continue;
        if (of_fluid)
          fluid += index[j] != i;
        else
          ++wall;
      }
    });
    listed.each(team, x, a.now.position, [&](int, int j, float4, Float3, float r2) DECANT_INLINE {
      if (!(r2 < c.H2)) return;
      if (j < a.base)
        ++fluid_listed;
      else
        ++wall_listed;
    });
    fluid = team.sum(fluid);
    wall = team.sum(wall);
    fluid_listed = team.sum(fluid_listed);
    wall_listed = team.sum(wall_listed);
    if (!team.leads()) return;
    add(&a.mailbox->pairs, fluid);
    add(&a.mailbox->wall_pairs, wall);
    add(&a.mailbox->pairs_missed, fluid - fluid_listed);
    add(&a.mailbox->wall_pairs_missed, wall - wall_listed);
    if (promised && (fluid != fluid_listed || wall != wall_listed))
      report(&a.mailbox->missed, a.mailbox->ended + 1, a.id[i]);
  }

 private:
  DECANT_DEVICE static void add(long long* to, int value) {
    if (value != 0) atomic_add(to, value);
  }
};

/// What it needs beside the lists.
class ListVerifier {
 public:
  void prepare(Queue& queue, const CellTable& table, int n, SortScratch& scratch) {
    cells_.prepare(queue, table, n, scratch);
    position_.resize(static_cast<std::size_t>(n));
    index_.resize(static_cast<std::size_t>(n));
    room_.resize(static_cast<std::size_t>(n));
  }
  std::size_t bytes() const {
    return cells_.bytes() + position_.bytes() + index_.bytes() + room_.bytes();
  }

  /// \param around  the candidates that lists are made from; only walls are taken from there
  template <int lanes, bool periodic>
  void count(Queue& queue, const Constants& c, const Arrays& a, Candidates around,
             const ListQuery<periodic>& listed, bool promised, SortScratch& scratch) {
    cells_.counting(queue, a.n, VerifySource{a, position_.get(), index_.get(), room_.get()}, scratch);
    around.all_fluid = false;
    around.table = cells_.table();
    queue.for_each_group<lanes>(
        a.n, VerifyPass<periodic>{c, a, around, position_.get(), index_.get(), listed, promised});
  }

 private:
  CellSort cells_;
  Buffer<float4> position_;
  Buffer<int> index_;
  Buffer<int2> room_;
};

}  // namespace decant::gpu::DECANT_EXECUTOR
