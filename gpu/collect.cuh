/// \file
/// How lists are written, to H and a skin: by threads that test the particles of the cells around.
#pragma once

#include "gpu/queries.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// Writes the lists, fluid and wall neighbors alike: near a wall its particles take the place of the
/// missing fluid, so one short capacity serves both. Evaluates nothing: hits are rare among candidates,
/// and a kernel evaluated for one lane in ten costs as much as for all. Lanes need not agree on
/// anything.
template <bool periodic>
struct CollectPass {
  Constants c;
  Arrays a;
  Candidates candidates;
  Particles sorted;  // the fluid; wall particles are in a.now
  Lists lists;
  Particles copies;  // where the fluid goes as well; null: nowhere

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    const int i = team.particle(0);
    const float4 own = sorted.position[i];
    const float reach = c.H + a.mailbox->skin;
    // Without skin exactly what the passes take for a neighbor.
    const float reach2 = reach * reach > c.H2 ? reach * reach : c.H2;
    Shelf shelf{i, xyz(own), reach2, lists.words(i, team.lane()), {}, 0};
    candidates.around<periodic>(team.lane(), Team::lanes, shelf.x, a.poses_now(),
                                [&](Candidates::Run run) DECANT_INLINE {
      if (run.listed)
        search<Team::lanes>(shelf, run.begin, run.end,
                            [&](int k) DECANT_INLINE { return read_only(run.listed + k); },
                            a.now.position);
      else
        search<1>(shelf, run.begin, run.end, [](int k) DECANT_INLINE { return k; },
                  run.begin < a.base ? sorted.position : a.now.position);
    });
    lists.count_of(i, team.lane()) = shelf.count;
    if (shelf.count > lists.capacity) atomic_maximum(&a.mailbox->longest_list, shelf.count);
    while (shelf.count % 4 != 0) put(shelf, lists.ghost);
    if (!copies.position || !team.leads()) return;
    copies.position[i] = own;
    copies.velocity[i] = sorted.velocity[i];
  }

 private:
  /// A lane's list on its way; counts on where there is no more room.
  struct Shelf {
    int i;
    Float3 x;
    float reach2;
    int4* word;
    int4 last;  // the word being filled
    int count;
  };

  /// Candidates k, k + step, … before `end`. Written for few instructions a candidate: this is where a
  /// hash spends its time. (Marking hits in a mask and writing them after the row took longer.)
  template <int step, class Index>
  DECANT_DEVICE void search(Shelf& shelf, int k, int end, Index index, const float4* points) const {
    constexpr int batch = 4;
#pragma unroll 1
    for (; k + (batch - 1) * step < end; k += batch * step) {
      int j[batch];
      float4 other[batch];
#pragma unroll
      for (int b = 0; b < batch; ++b) j[b] = index(k + b * step);
#pragma unroll
      for (int b = 0; b < batch; ++b) other[b] = read_only(points + j[b]);
#pragma unroll
      for (int b = 0; b < batch; ++b) test(shelf, j[b], other[b]);
    }
#pragma unroll 1
    for (; k < end; k += step) {
      const int j = index(k);
      test(shelf, j, read_only(points + j));
    }
  }
  DECANT_DEVICE void test(Shelf& shelf, int j, float4 other) const {
    const Float3 d = nearest_image<periodic>(c, shelf.x - xyz(other));
    if (dot(d, d) < shelf.reach2 && j != shelf.i) put(shelf, j);
  }
  DECANT_DEVICE void put(Shelf& shelf, int j) const {
    shelf.last = make_int4(shelf.last.y, shelf.last.z, shelf.last.w, j);
    if (++shelf.count % 4 != 0) return;
    if (shelf.count <= lists.capacity) *shelf.word = shelf.last;
    shelf.word += lists.lanes;
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
