/// \file
/// How lists are written, to H and a skin: by threads that test the particles of the cells around.
#pragma once

#include "gpu/core/staging_buffer.cuh"
#include "gpu/core/stream.cuh"
#include "gpu/kernels/neighbor_ranges.cuh"

namespace decant::gpu {
namespace {

/// Rows of cells around a team's particle, in shared memory: each is looked up by one of its threads.
template <int lanes>
class RowRanges {
 public:
  /// One thread alone has both parts of rows that go around the table's end, of half of the rows at a time.
  static constexpr int most = lanes == 1 ? 2 * ((CellTable::rows + 1) / 2) : CellTable::rows;
  static constexpr int stride = most / 2 * 2 + 1;  // odd, for different banks

  /// Behind the staging buffers.
  DECANT_DEVICE int2& operator[](int r) {
#ifdef __CUDACC__
    int2* all = reinterpret_cast<int2*>(shared_memory() + static_cast<int>(blockDim.x) * StagingBuffer::stride);
    return all[static_cast<int>(threadIdx.x) / lanes * stride + r];
#else
    return all_[r];
#endif
  }

#ifndef __CUDACC__
 private:
  int2 all_[most];
#endif
};

/// Writes the lists, fluid and wall neighbors alike: near a wall its particles take the place of the
/// missing fluid, so one short capacity serves both. Evaluates nothing: hits are rare among candidates,
/// and a kernel function evaluated for one thread in ten costs as much as for all.
template <bool periodic>
struct BuildList {
  Constants c;
  ParticleArrays a;
  Candidates candidates;
  Particles sorted;         // the fluid; wall particles are in a.current
  const float4* positions;  // of the fluid, that lists are built around
  Lists lists;
  Particles copies;  // where the fluid goes as well; null: nowhere

  /// Of a block of so many threads, so many of them per particle.
  static constexpr std::size_t shared_bytes(int lanes, int threads) {
    const int rows = lanes == 1 ? RowRanges<1>::stride : RowRanges<2>::stride;
    return static_cast<std::size_t>(threads * StagingBuffer::stride +
                                    threads / lanes * rows * static_cast<int>(sizeof(int2)));
  }

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    const int i = team.particle(0);
    if (a.is_ghost(i)) {
      lists.count_of(i, team.lane()) = 0;
      if (team.is_leader()) copy(i, sorted.position[i], sorted.velocity[i]);
      return;
    }
    const Float3 x = xyz(positions[i]);
    const float reach = c.H + a.status->skin;
    // Without skin exactly what the kernels take for a neighbor.
    const float reach2 = reach * reach > c.H2 ? reach * reach : c.H2;
    ListWriter list{i, x, reach2, lists.words(i, team.lane()), {}, 0};
    fluid(team, list);
    const float4 own = sorted.position[i], velocity = sorted.velocity[i];
    const Float3 moved = x - xyz(own);
    if (!far_from_walls(x, velocity.w - sqrtf(dot(moved, moved)), reach))
      candidates.walls_around<periodic>(team.lane(), list.x, a.poses_before(), [&](Candidates::Run run) DECANT_INLINE {
        if (run.listed) walls<true, Team::lanes>(list, run);
        else walls<false, Team::lanes>(list, run);
      });
    const int count = list.sent + list.staged.size();
    lists.count_of(i, team.lane()) = count;
    if (count > lists.capacity) atomic_maximum(&a.status->longest_list, count);
    while (list.staged.size() % 4 != 0) list.staged.append(true, lists.sentinel);
    send(list, StagingBuffer::capacity);
    if (team.is_leader()) copy(i, own, velocity);
  }

 private:
  DECANT_DEVICE void copy(int i, float4 position, float4 velocity) const {
    if (!copies.position) return;
    copies.position[i] = position;
    copies.velocity[i] = velocity;
  }
  /// Whether it is out of reach of all solids, and so of their particles.
  DECANT_DEVICE static bool far_from_walls(Float3 x, float clearance, float reach) {
    return clearance - rounding_of(x) > 1.001f * reach;
  }
  /// A thread's list on its way; counts on where there is no more room.
  struct ListWriter {
    int i;
    Float3 x;
    float reach2;
    int4* word;
    StagingBuffer staged;
    int sent;
  };

  static constexpr int batch = 4;

  /// Rows of cells one after the other as if they were one, so that positions are always under way while
  /// others are tested. Written for few instructions per candidate: this is where a hash spends its time.
  /// (Marking hits in a mask and writing them after the row took longer.)
  template <class Team>
  DECANT_DEVICE void fluid(Team& team, ListWriter& list) const {
    const int bucket = candidates.all_fluid ? 0 : candidates.table.bucket_of(list.x);
    const bool twice = !candidates.all_fluid && candidates.table.goes_around(bucket);
    RowRanges<Team::lanes> rows;
#pragma unroll 1
    for (int turn = 0; turn < (twice ? 2 : 1); ++turn) {
      const int found = find_rows(team, rows, bucket, twice, turn);
      team.sync();
      int r = -1, k = 0, end = 0;
      const auto advance = [&]() DECANT_INLINE {
        k += batch * Team::lanes;
        while (k >= end && ++r < found) {
          const int2 run = rows[r];
          k = run.x + team.lane();
          end = run.y;
        }
      };
      // Tests one batch while the next one, or at the end anything, is on its way.
      const auto step = [&](const float4(&now)[batch], float4(&next)[batch]) DECANT_INLINE {
        const int first = k, last = end;
        advance();
        load<Team::lanes>(r < found ? k : 0, next);
        send(list, batch);
#pragma unroll
        for (int b = 0; b < batch; ++b) {
          const int j = first + b * Team::lanes;
          test(list, j, now[b], (j < last) & (j != list.i));
        }
        return r < found;
      };
      advance();
      float4 even[batch], odd[batch];
      load<Team::lanes>(r < found ? k : 0, even);
      if (r < found)
#pragma unroll 1
        while (step(even, odd) && step(odd, even)) {
        }
      team.sync();
    }
  }
  /// The rows of a turn; their number. Rows that go around the table's end have two parts: first parts of all rows in
  /// the first turn, second ones in the second. One thread alone visits candidates in an order that no table's size
  /// changes, for ranks have tables of their own: row by row, half of them in each turn.
  template <class Team>
  DECANT_DEVICE int find_rows(Team& team, RowRanges<Team::lanes>& rows, int bucket, bool twice, int turn) const {
    if (candidates.all_fluid) {
      if (team.is_leader()) rows[0] = make_int2(0, a.n);
      return 1;
    }
    constexpr bool alone = Team::lanes == 1;
    constexpr int half = (CellTable::rows + 1) / 2;
    const int past = alone && twice && turn == 0 ? half : CellTable::rows;
    int found = 0;
    for (int r = alone ? turn * half : team.lane(); r < past; r += Team::lanes) {
      const CellTable::Range row = candidates.table.row<periodic>(bucket, r);
      const int2 first = make_int2(row.begin, row.end), second = make_int2(row.begin2, row.end2);
      if (!alone) rows[r] = turn == 0 ? first : second;
      else {
        rows[found++] = first;
        if (twice) rows[found++] = second;
      }
    }
    return alone ? found : CellTable::rows;
  }
  template <int step>
  DECANT_DEVICE void load(int k, float4 (&to)[batch]) const {
#pragma unroll
    for (int b = 0; b < batch; ++b) to[b] = positions[k + b * step];
  }
  /// The same of walls: while one batch is tested, the positions of the next and the numbers of the one after
  /// it are on their way.
  template <bool listed, int step>
  DECANT_DEVICE void walls(ListWriter& list, Candidates::Run run) const {
    if (run.begin >= run.end) return;
    const auto numbers = [&](int k, int(&j)[batch]) DECANT_INLINE {
#pragma unroll
      for (int b = 0; b < batch; ++b) {
        const int at = k + b * step < run.end ? k + b * step : run.begin;
        j[b] = listed ? run.listed[at] : at;
      }
    };
    const auto places = [&](const int(&j)[batch], float4(&to)[batch]) DECANT_INLINE {
#pragma unroll
      for (int b = 0; b < batch; ++b) to[b] = a.current.position[j[b]];
    };
    int k = run.begin, even[batch], odd[batch];
    float4 even_positions[batch], odd_positions[batch];
    const auto one = [&](int(&now)[batch], const float4(&now_positions)[batch], const int(&next)[batch],
                         float4(&next_positions)[batch]) DECANT_INLINE {
      places(next, next_positions);
      send(list, batch);
#pragma unroll
      for (int b = 0; b < batch; ++b) test(list, now[b], now_positions[b], k + b * step < run.end);
      numbers(k + 2 * batch * step, now);
      k += batch * step;
      return k < run.end;
    };
    numbers(k, even);
    numbers(k + batch * step, odd);
    places(even, even_positions);
#pragma unroll 1
    while (one(even, even_positions, odd, odd_positions) && one(odd, odd_positions, even, even_positions)) {
    }
  }
  /// No short cuts: a branch costs more than what it saves.
  DECANT_DEVICE void test(ListWriter& list, int j, float4 other, int there) const {
    const Float3 d = nearest_image<periodic>(c, list.x - xyz(other));
    const int near = dot(d, d) < list.reach2;
    list.staged.append(near & there, j);
  }
  /// So that there is room for `more`.
  DECANT_DEVICE void send(ListWriter& list, int more) const {
    list.staged.flush(more, [&](int4 word) DECANT_INLINE {
      if (list.sent < lists.capacity) *list.word = word;
      list.word += Lists::beside;
      list.sent += 4;
    });
  }
};

template <class Team, bool periodic>
DECANT_KERNEL(Team::block_size, Team::blocks_per_multiprocessor)
build_list_kernel(int n, BuildList<periodic> build) {
  for_each_team<Team>(n, build);
}
template <class Team, bool periodic>
void launch_build_list(Stream& stream, int n, const BuildList<periodic>& build) {
  stream.launch_teams_sharing<Team>(BuildList<periodic>::shared_bytes(Team::lanes, Team::block_size),
                                    build_list_kernel<Team, periodic>, n, build);
}

}  // namespace
}  // namespace decant::gpu
