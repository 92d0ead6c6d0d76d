/// \file
/// How lists are written, to H and a skin: by threads that test the particles of the cells around.
#pragma once

#include "gpu/queries.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// The rows of cells around a group's particle, in shared memory: each is found by one of its lanes.
template <class Team>
class RunTable {
 public:
  static constexpr int bytes = CellTable::rows * static_cast<int>(sizeof(int2));

  /// On the desk, behind the outboxes.
  DECANT_DEVICE int2& run(int r) {
#ifdef __CUDACC__
    int2* all = reinterpret_cast<int2*>(desk() + static_cast<int>(blockDim.x) * Outbox::stride);
    return all[static_cast<int>(threadIdx.x) / Team::lanes * CellTable::rows + r];
#else
    return all_[r];
#endif
  }

#ifndef __CUDACC__
 private:
  int2 all_[CellTable::rows];
#endif
};

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
  const float4* points;  // where lists have the fluid
  Lists lists;
  Particles copies;  // where the fluid goes as well; null: nowhere

  template <int lanes>
  static constexpr std::size_t desk_bytes(int threads) {
    return static_cast<std::size_t>(threads * Outbox::stride +
                                    threads / lanes * RunTable<Group<lanes>>::bytes);
  }

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    const int i = team.particle(0);
    const Float3 x = xyz(points[i]);
    const float reach = c.H + a.mailbox->skin;
    // Without skin exactly what the passes take for a neighbor.
    const float reach2 = reach * reach > c.H2 ? reach * reach : c.H2;
    Shelf shelf{i, x, reach2, lists.words(i, team.lane()), {}, 0};
    fluid(team, shelf);
    const float4 own = sorted.position[i], velocity = sorted.velocity[i];
    const Float3 way = x - xyz(own);
    if (!far_from_walls(x, velocity.w - sqrtf(dot(way, way)), reach))
      candidates.walls_around<periodic>(team.lane(), shelf.x, a.poses_before(),
                                        [&](Candidates::Run run) DECANT_INLINE {
        if (run.listed)
          walls<true, Team::lanes>(shelf, run);
        else
          walls<false, Team::lanes>(shelf, run);
      });
    const int count = shelf.sent + shelf.box.held();
    lists.count_of(i, team.lane()) = count;
    if (count > lists.capacity) atomic_maximum(&a.mailbox->longest_list, count);
    while (shelf.box.held() % 4 != 0) shelf.box.put(true, lists.ghost);
    send(shelf, Outbox::room);
    if (!copies.position || !team.leads()) return;
    copies.position[i] = own;
    copies.velocity[i] = velocity;
  }

 private:
  /// Whether it is out of reach of all solids, and so of their particles.
  DECANT_DEVICE static bool far_from_walls(Float3 x, float clear, float reach) {
    return clear - rounding_of(x) > 1.001f * reach;
  }
  /// A lane's list on its way; counts on where there is no more room.
  struct Shelf {
    int i;
    Float3 x;
    float reach2;
    int4* word;
    Outbox box;
    int sent;
  };

  static constexpr int batch = 4;

  /// Rows of cells one after the other as if they were one, so that points are always under way while
  /// others are tested. Written for few instructions a candidate: this is where a hash spends its time.
  /// (Marking hits in a mask and writing them after the row took longer.)
  template <class Team>
  DECANT_DEVICE void fluid(Team& team, Shelf& shelf) const {
    const int bucket = candidates.all_fluid ? 0 : candidates.table.bucket_of(shelf.x);
    const bool twice = !candidates.all_fluid && candidates.table.goes_around(bucket);
    RunTable<Team> table;
#pragma unroll 1
    for (int part = 0; part < (twice ? 2 : 1); ++part) {
      for (int r = team.lane(); r < CellTable::rows; r += Team::lanes) {
        if (candidates.all_fluid) {
          table.run(r) = make_int2(0, r == 0 ? a.n : 0);
          continue;
        }
        const CellTable::Range row = candidates.table.row<periodic>(bucket, r);
        table.run(r) = part == 0 ? make_int2(row.begin, row.end) : make_int2(row.begin2, row.end2);
      }
      team.sync();
      int r = -1, k = 0, end = 0;
      const auto advance = [&]() DECANT_INLINE {
        k += batch * Team::lanes;
        while (k >= end && ++r < CellTable::rows) {
          const int2 run = table.run(r);
          k = run.x + team.lane();
          end = run.y;
        }
      };
      // Tests one batch while the next one, or at the end anything, is on its way.
      const auto step = [&](const float4 (&now)[batch], float4 (&next)[batch]) DECANT_INLINE {
        const int first = k, last = end;
        advance();
        load<Team::lanes>(r < CellTable::rows ? k : 0, next);
        send(shelf, batch);
#pragma unroll
        for (int b = 0; b < batch; ++b) {
          const int j = first + b * Team::lanes;
          test(shelf, j, now[b], (j < last) & (j != shelf.i));
        }
        return r < CellTable::rows;
      };
      advance();
      float4 even[batch], odd[batch];
      load<Team::lanes>(r < CellTable::rows ? k : 0, even);
      if (r < CellTable::rows)
#pragma unroll 1
        while (step(even, odd) && step(odd, even)) {
        }
      team.sync();
    }
  }
  template <int step>
  DECANT_DEVICE void load(int k, float4 (&to)[batch]) const {
#pragma unroll
    for (int b = 0; b < batch; ++b) to[b] = points[k + b * step];
  }
  /// The same of walls: while one batch is tested, the points of the next and the numbers of the one after
  /// it are on their way.
  template <bool listed, int step>
  DECANT_DEVICE void walls(Shelf& shelf, Candidates::Run run) const {
    if (run.begin >= run.end) return;
    const auto numbers = [&](int k, int (&j)[batch]) DECANT_INLINE {
#pragma unroll
      for (int b = 0; b < batch; ++b) {
        const int at = k + b * step < run.end ? k + b * step : run.begin;
        j[b] = listed ? run.listed[at] : at;
      }
    };
    const auto places = [&](const int (&j)[batch], float4 (&to)[batch]) DECANT_INLINE {
#pragma unroll
      for (int b = 0; b < batch; ++b) to[b] = a.now.position[j[b]];
    };
    int k = run.begin, even[batch], odd[batch];
    float4 even_points[batch], odd_points[batch];
    const auto one = [&](int (&now)[batch], const float4 (&points_now)[batch], const int (&next)[batch],
                         float4 (&points_next)[batch]) DECANT_INLINE {
      places(next, points_next);
      send(shelf, batch);
#pragma unroll
      for (int b = 0; b < batch; ++b) test(shelf, now[b], points_now[b], k + b * step < run.end);
      numbers(k + 2 * batch * step, now);
      k += batch * step;
      return k < run.end;
    };
    numbers(k, even);
    numbers(k + batch * step, odd);
    places(even, even_points);
#pragma unroll 1
    while (one(even, even_points, odd, odd_points) && one(odd, odd_points, even, even_points)) {
    }
  }
  /// No short cuts: a branch costs more than what it saves.
  DECANT_DEVICE void test(Shelf& shelf, int j, float4 other, int there) const {
    const Float3 d = nearest_image<periodic>(c, shelf.x - xyz(other));
    const int near = dot(d, d) < shelf.reach2;
    shelf.box.put(near & there, j);
  }
  /// So that there is room for `more`.
  DECANT_DEVICE void send(Shelf& shelf, int more) const {
    shelf.box.relieve(more, [&](int4 word) DECANT_INLINE {
      if (shelf.sent < lists.capacity) *shelf.word = word;
      shelf.word += Lists::beside;
      shelf.sent += 4;
    });
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
