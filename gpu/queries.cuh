/// \file
/// Two queries: CellQuery tests every particle of the cells around, ListQuery reads lists.
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

  /// A lane's run of candidates: indices begin, begin + lanes, … before end, or what is listed there.
  struct Run {
    int begin, end;
    const int* listed;
  };

  /// run(Run) for a lane's share of all that may be near x, fluid and then wall: rows of cells by turns,
  /// single entries of what is listed. It is called at one place, so that its
  /// body is there once: copies would drive each other out of the instruction cache.
  template <bool periodic, class Body>
  DECANT_DEVICE void around(int lane, Float3 x, const DevicePose* poses_now,
                            Body&& run) const {
    looked_up<periodic>(lane, -1, containers, x, poses_now, run);
  }
  /// The same of walls alone.
  template <bool periodic, class Body>
  DECANT_DEVICE void walls_around(int lane, Float3 x, const DevicePose* poses_now, Body&& run) const {
    looked_up<periodic>(lane, 0, containers, x, poses_now, run);
  }
  /// The same of container k alone, x in the frame of its lookups.
  template <bool periodic, class Body>
  DECANT_DEVICE void of_segment(int lane, int k, Float3 x, Body&& run) const {
    looked_up<periodic>(lane, k, k + 1, x, nullptr, run);
  }

 private:
  /// Of the fluid (k = −1) and containers; without poses x is in the frame of the only one.
  template <bool periodic, class Body>
  DECANT_DEVICE void looked_up(int lane, int k, int end, Float3 x,
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
          if (s->out_of_reach(at)) continue;
        }
        bucket = t->bucket_of(at);
        if (wall && s->near) {
          by_rows = false;
          first = 0;
          whole = {s->near_start[bucket], s->near_start[bucket + 1], s->near};
        }
      }
#pragma unroll 1
      for (int d = 0; d < (by_rows ? 9 : 1); ++d) {
        CellTable::Range r{whole.begin, whole.end, 0, 0};
        if (by_rows) r = t->template row<periodic>(bucket, d);
#pragma unroll 1
        for (int part = 0; part < 2 && (part == 0 || r.begin2 < r.end2); ++part)
          run(Run{first + lane + (part ? r.begin2 : r.begin), first + (part ? r.end2 : r.end),
                  whole.listed});
      }
    }
  }
};

/// What points carry as their fourth component is what a pass needs of them.
struct FullPoints {
  Constants c;

  DECANT_DEVICE float weight(int, float4 other) const { return other.w; }
  DECANT_DEVICE float pressure_term(int, float4 other) const { return other.w; }
};

template <bool periodic>
struct CellQuery : FullPoints {
  Candidates candidates;
  Arrays a;

  template <class Team, class Visit>
  DECANT_DEVICE void each(Team& team, const Float3 (&x)[1], const float4* points,
                          Visit&& visit) const {
    const int i = team.particle(0);
    candidates.around<periodic>(team.lane(), x[0], a.poses_before(),
                                [&](Candidates::Run run) DECANT_INLINE {
      test<Team::lanes>(x[0], points, run,
                        [&](int j, float4 other, Float3 d, float r2) DECANT_INLINE {
        if (j != i) visit(0, j, other, d, r2);
      });
    });
  }
  template <class Team, class Visit>
  DECANT_DEVICE void of_segment(Team& team, int k, const Float3 (&x)[1], const float4* points,
                                Visit&& visit) const {
    candidates.of_segment<periodic>(team.lane(), k, x[0],
                                    [&](Candidates::Run run) DECANT_INLINE {
      test<Team::lanes>(x[0], points, run,
                        [&](int, float4, Float3, float r2) DECANT_INLINE { visit(0, r2); });
    });
  }

 private:
  template <int lanes, class Near>
  DECANT_DEVICE void test(Float3 x, const float4* points, Candidates::Run run, Near&& near) const {
    for (int k = run.begin; k < run.end; k += lanes) {
      const int j = run.listed ? run.listed[k] : k;
      const float4 other = points[j];
      const Float3 d = nearest_image<periodic>(c, x - xyz(other));
      const float r2 = dot(d, d);
      if (r2 < c.H2) near(j, other, d, r2);
    }
  }
};

/// Neighbor lists, fluid and wall alike: near a wall its particles take the place of the missing fluid,
/// so one short capacity serves both. Each lane that works on a particle has a list of its own. Four
/// entries are one word; words of the threads of a warp lie side by side, so that it reads whole lines of
/// memory. The last word is filled up with `ghost`, a point far from everything.
struct Lists {
#ifdef __CUDACC__
  static constexpr int beside = 32;
#else
  static constexpr int beside = 1;
#endif
  // Word w of thread t = i × lanes + lane is at (⌊t/beside⌋ × capacity/4 + w) × beside + t mod beside.
  int4* word;
  int lanes;
  int capacity;  // entries a lane, a multiple of 4
  int ghost;
  int* count;    // [n × lanes]; more than capacity: the list is cut, and useless

  /// Words of lists with so many entries, of so many threads.
  static std::size_t room(std::size_t threads, int entries) {
    const std::size_t side = beside;
    return (threads + side - 1) / side * side * static_cast<std::size_t>(entries / 4);
  }
  /// The first; each next one is `beside` further on.
  DECANT_DEVICE int4* words(int i, int lane) const {
    const unsigned thread = static_cast<unsigned>(i * lanes + lane);
    return word + static_cast<std::size_t>(thread / beside * static_cast<unsigned>(capacity / 4)) * beside +
           thread % beside;
  }
  DECANT_DEVICE int& count_of(int i, int lane) const {
    return count[static_cast<std::size_t>(i) * static_cast<std::size_t>(lanes) +
                 static_cast<std::size_t>(lane)];
  }
};

template <bool periodic>
struct ListQuery : FullPoints {
  Lists lists;

  template <class Team, class Visit>
  DECANT_DEVICE void each(Team& team, const Float3 (&x)[1], const float4* points,
                          Visit&& visit) const {
    const int i = team.particle(0), listed = lists.count_of(i, team.lane());
    const int words = ((listed < lists.capacity ? listed : lists.capacity) + 3) / 4;
    if (words == 0) return;
    const int4* from = lists.words(i, team.lane());
    const auto word = [&](int w) DECANT_INLINE {
      return w < words ? from[w * Lists::beside]
                       : make_int4(lists.ghost, lists.ghost, lists.ghost, lists.ghost);
    };
    // What comes next is on its way while this word is worked on: the next word, and where a thread has
    // a particle to itself, so that there are few others to wait for, that one's points as well.
    if constexpr (Team::lanes > 1 || !gathers_ahead) {
      float4 points_now[4];
      int4 next = word(0);
#pragma unroll 1
      for (int w = 0; w < words; ++w) {
        const int4 now = next;
        next = word(w + 1);
        gather(points, now, points_now);
        use(x[0], now, points_now, visit);
      }
    } else {
      int w = 0;
      int4 even = word(0), odd = word(1);
      float4 even_points[4], odd_points[4];
      const auto step = [&](int4& now, const float4 (&points_now)[4], int4 next,
                            float4 (&points_next)[4]) DECANT_INLINE {
        gather(points, next, points_next);
        const int4 j = now;
        now = word(w + 2);
        use(x[0], j, points_now, visit);
        return ++w < words;
      };
      gather(points, even, even_points);
#pragma unroll 1
      while (step(even, even_points, odd, odd_points) && step(odd, odd_points, even, even_points)) {
      }
    }
  }

 private:
#ifdef __CUDACC__
  static constexpr bool gathers_ahead = true;
#else
  static constexpr bool gathers_ahead = false;
#endif
  DECANT_DEVICE static void gather(const float4* points, int4 j, float4 (&to)[4]) {
    to[0] = points[j.x];
    to[1] = points[j.y];
    to[2] = points[j.z];
    to[3] = points[j.w];
  }
  template <class Visit>
  DECANT_DEVICE void use(Float3 x, int4 word, const float4 (&points)[4], Visit&& visit) const {
    const int j[4] = {word.x, word.y, word.z, word.w};
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      const Float3 d = nearest_image<periodic>(c, x - xyz(points[k]));
      // In a periodic scene nothing is far from everything.
      const bool there = !periodic || j[k] != lists.ghost;
      visit(0, j[k], points[k], d, there ? dot(d, d) : 4.0f * c.H2);
    }
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
