/// \file
/// Two queries: CellQuery tests every particle of the cells around, ListQuery reads lists. CollectPass
/// writes lists, to H and a skin, from cells.
#pragma once

#include "gpu/passes.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// Where the particles that may be near are to be found.
struct Candidates {
  bool all_fluid;   // every fluid particle is a candidate
  bool all_walls;   // every wall particle is
  int n, base;
  CellTable table;
  int containers;
  const WallSegment* segments;

  /// A lane's run of candidates: indices [begin, end), or what is listed at begin, begin + lanes, …
  struct Run {
    int begin, end;
    const int* listed;
  };

  /// run(Run) for a lane's share of all that may be near x, fluid and then wall: rows of cells by turns,
  /// single entries of what is listed. It is called at one place, so that its
  /// body is there once: copies would drive each other out of the instruction cache.
  template <bool periodic, class Body>
  DECANT_DEVICE void around(int lane, int lanes, Float3 x, const DevicePose* poses_now,
                            Body&& run) const {
    looked_up<periodic>(lane, lanes, -1, containers, x, poses_now, run);
  }
  /// The same of container k alone, x in the frame of its lookups.
  template <bool periodic, class Body>
  DECANT_DEVICE void of_segment(int lane, int lanes, int k, Float3 x, Body&& run) const {
    looked_up<periodic>(lane, lanes, k, k + 1, x, nullptr, run);
  }

 private:
  /// Of the fluid (k = −1) and containers; without poses x is in the frame of the only one.
  template <bool periodic, class Body>
  DECANT_DEVICE void looked_up(int lane, int lanes, int k, int end, Float3 x,
                               const DevicePose* poses_now, Body&& run) const {
#pragma unroll 1
    for (; k < end; ++k) {
      const bool wall = k >= 0;
      const WallSegment* s = segments + (wall ? k : 0);
      const CellTable* t = wall ? &s->table : &table;
      Run whole{0, n, nullptr};
      bool by_rows = !(wall ? all_walls : all_fluid);
      int bucket = 0, first = 0;
      if (wall) {
        first = base + s->begin;
        whole = {0, s->end - s->begin, nullptr};
      }
      if (by_rows) {
        Float3 at = x;
        if (wall && poses_now) {
          if (!s->in_world) at = rotate_back(poses_now[k], x - poses_now[k].translation);
          if (at.x < s->low.x || at.x > s->high.x || at.y < s->low.y || at.y > s->high.y ||
              at.z < s->low.z || at.z > s->high.z)
            continue;
        }
        bucket = t->bucket_of(at);
        if (wall && s->near) {
          by_rows = false;
          first = 0;
          whole = {s->near_start[bucket] + lane, s->near_start[bucket + 1], s->near};
        }
      }
      if (!by_rows && !whole.listed) {
        const int share = (whole.end + lanes - 1) / lanes, last = (lane + 1) * share;
        whole = {lane * share, last < whole.end ? last : whole.end, nullptr};
      }
#pragma unroll 1
      for (int d = by_rows ? lane : 0; d < (by_rows ? 9 : 1); d += lanes) {
        CellTable::Range r{whole.begin, whole.end, 0, 0};
        if (by_rows) r = t->template row<periodic>(bucket, d);
#pragma unroll 1
        for (int part = 0; part < 2 && (part == 0 || r.begin2 < r.end2); ++part)
          run(Run{first + (part ? r.begin2 : r.begin), first + (part ? r.end2 : r.end),
                  whole.listed});
      }
    }
  }
};

/// What points carry as their fourth component is what a pass needs of them.
struct FullPoints {
  Constants c;
  int base;

  DECANT_DEVICE float weight(int j, float4 other) const {
    return j < base ? c.mass : c.rest_density * other.w;
  }
  DECANT_DEVICE float pressure_term(int, float4 other) const { return other.w; }
};

template <bool periodic>
struct CellQuery : FullPoints {
  Candidates candidates;
  Arrays a;

  template <class Team, class Visit>
  DECANT_DEVICE void each(Team& team, int i, Float3 x, const float4* points, Visit&& visit) const {
    candidates.around<periodic>(team.lane(), Team::lanes, x, a.poses_now(),
                                [&](Candidates::Run run) DECANT_INLINE {
      test<Team::lanes>(i, x, points, run, visit);
    });
  }
  template <class Team, class Visit>
  DECANT_DEVICE void of_segment(Team& team, int k, Float3 x, const float4* points,
                                Visit&& visit) const {
    candidates.of_segment<periodic>(team.lane(), Team::lanes, k, x, [&](Candidates::Run run) DECANT_INLINE {
      test<Team::lanes>(-1, x, points, run, visit);
    });
  }

 private:
  template <int lanes, class Visit>
  DECANT_DEVICE void test(int i, Float3 x, const float4* points, Candidates::Run run,
                          Visit&& visit) const {
    for (int k = run.begin; k < run.end; k += run.listed ? lanes : 1) {
      const int j = run.listed ? read_only(run.listed + k) : k;
      const float4 other = read_only(points + j);
      const Float3 d = nearest_image<periodic>(c, x - xyz(other));
      const float r2 = dot(d, d);
      if (r2 < c.H2 && j != i) visit(j, other, d, r2);
    }
  }
};

/// Neighbor lists of all particles, one for each lane that will work on the particle: entry e of lane l
/// of particle i at entry[e × lanes × n + i × lanes + l], so that the threads of a warp write and read
/// consecutive words.
struct Lists {
  int* entry;
  int lanes;
  unsigned step;  // lanes × n
  int capacity;   // entries a lane
  int* count;     // [n × lanes]; more than capacity: the list is cut, and useless

  DECANT_DEVICE std::size_t first(int i, int lane) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(lanes) +
           static_cast<std::size_t>(lane);
  }
};

/// Writes the lists, fluid and wall neighbors alike: near a wall its particles take the place of the
/// missing fluid, so one short capacity serves both. Evaluates nothing: hits are rare among candidates,
/// and a kernel evaluated for one lane in ten costs as much as for all. Lanes need not agree on
/// anything. A particle finds itself too; who reads the list skips it.
template <bool periodic>
struct CollectPass {
  Constants c;
  Arrays a;
  Candidates candidates;
  Particles sorted;  // the fluid; wall particles are in a.now
  Lists lists;
  Particles copies;  // where the fluid goes as well; null: nowhere

  template <class Team>
  DECANT_DEVICE void operator()(Team& team, int i, bool) const {
    const float4 own = sorted.position[i];
    const float reach = c.H + a.mailbox->skin;
    Shelf shelf{xyz(own), reach * reach, lists.entry + lists.first(i, team.lane()), 0};
    candidates.around<periodic>(team.lane(), Team::lanes, shelf.x, a.poses_now(),
                                [&](Candidates::Run run) DECANT_INLINE {
      if (run.listed)
        search<Team::lanes>(shelf, run.begin, run.end,
                            [&](int k) DECANT_INLINE { return read_only(run.listed + k); }, a.now.position);
      else
        search<1>(shelf, run.begin, run.end, [](int k) DECANT_INLINE { return k; },
                            run.begin < a.base ? sorted.position : a.now.position);
    });
    lists.count[lists.first(i, team.lane())] = shelf.count;
    if (shelf.count > lists.capacity) atomic_maximum(&a.mailbox->longest_list, shelf.count);
    if (!copies.position || !team.leads()) return;
    copies.position[i] = own;
    copies.velocity[i] = sorted.velocity[i];
  }

 private:
  /// A lane's list on its way; counts on where there is no more room.
  struct Shelf {
    Float3 x;
    float reach2;
    int* entry;
    int count;
  };

  /// Candidates k, k + step, … before `end`. Written for few instructions a candidate: this is where a
  /// hash spends its time.
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
    if (!(dot(d, d) < shelf.reach2)) return;
    if (shelf.count < lists.capacity)
      shelf.entry[static_cast<std::uint64_t>(static_cast<unsigned>(shelf.count)) * lists.step] = j;
    ++shelf.count;
  }
};

template <bool periodic>
struct ListQuery : FullPoints {
  Lists lists;

  template <class Team, class Visit>
  DECANT_DEVICE void each(Team& team, int i, Float3 x, const float4* points, Visit&& visit) const {
    constexpr int batch = 4;  // fetched together, then used
    const std::size_t first = lists.first(i, team.lane());
    const int listed = lists.count[first];
    const int count = listed < lists.capacity ? listed : lists.capacity;
    const int* from = lists.entry + first;
    for (int e = 0; e < count; e += batch) {
      int j[batch];
      float4 other[batch];
#pragma unroll
      for (int k = 0; k < batch; ++k) {
        j[k] = e + k < count ? read_only(from) : i;
        from += lists.step;
      }
#pragma unroll
      for (int k = 0; k < batch; ++k) other[k] = read_only(points + j[k]);
#pragma unroll
      for (int k = 0; k < batch; ++k) {
        const Float3 d = nearest_image<periodic>(c, x - xyz(other[k]));
        // The particle itself, in the list and past its end, adds nothing from far away.
        visit(j[k], other[k], d, j[k] != i ? dot(d, d) : 4.0f * c.H2);
      }
    }
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
