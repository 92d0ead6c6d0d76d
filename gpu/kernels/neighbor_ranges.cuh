/// \file
/// Neighbor ranges (concepts.hpp) of cells and of lists: CellNeighbors tests every particle of the cells around,
/// ListNeighbors reads lists.
#pragma once

#include "gpu/kernels/place_walls.cuh"

namespace decant::gpu {
namespace {

/// Where the particles that may be near are to be found.
struct Candidates {
  bool all_fluid;  // every fluid particle is a candidate
  bool all_walls;  // every wall particle is
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
  DECANT_DEVICE void around(int lane, Float3 x, const DevicePose* poses_now, Body&& run) const {
    looked_up<periodic>(lane, -1, containers, x, poses_now, run);
  }
  /// The same of walls alone.
  template <bool periodic, class Body>
  DECANT_DEVICE void walls_around(int lane, Float3 x, const DevicePose* poses_now, Body&& run) const {
    looked_up<periodic>(lane, 0, containers, x, poses_now, run);
  }
  /// The same of container k alone, x in the frame of its lookups.
  template <bool periodic, class Body>
  DECANT_DEVICE void of_container(int lane, int k, Float3 x, Body&& run) const {
    looked_up<periodic>(lane, k, k + 1, x, nullptr, run);
  }

 private:
  /// Of the fluid (k = −1) and containers; without poses x is in the frame of the only one.
  template <bool periodic, class Body>
  DECANT_DEVICE void looked_up(int lane, int k, int end, Float3 x, const DevicePose* poses_now, Body&& run) const {
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
          run(Run{first + lane + (part ? r.begin2 : r.begin), first + (part ? r.end2 : r.end), whole.listed});
      }
    }
  }
};

/// The fourth component of a position is what kernels need of a neighbor.
struct WeightsInPositions {
  Constants c;

  DECANT_DEVICE float weight(int, float4 other) const { return other.w; }
  DECANT_DEVICE float pressure_term(int, float4 other) const { return other.w; }
};

template <bool periodic>
struct CellNeighbors : WeightsInPositions {
  Candidates candidates;
  ParticleArrays a;

  template <class Team, class Visit>
  DECANT_DEVICE void for_each(Team& team, const Float3 (&x)[1], const float4* positions, Visit&& visit) const {
    const int i = team.particle(0);
    candidates.around<periodic>(team.lane(), x[0], a.poses_before(), [&](Candidates::Run run) DECANT_INLINE {
      test<Team::lanes>(x[0], positions, run, [&](int j, float4 other, Float3 d, float r2) DECANT_INLINE {
        if (j != i) visit(0, j, other, d, r2);
      });
    });
  }
  template <class Team, class Visit>
  DECANT_DEVICE void for_each_of_container(Team& team, int k, const Float3 (&x)[1], const float4* positions,
                                           Visit&& visit) const {
    candidates.of_container<periodic>(team.lane(), k, x[0], [&](Candidates::Run run) DECANT_INLINE {
      test<Team::lanes>(x[0], positions, run, [&](int, float4, Float3, float r2) DECANT_INLINE { visit(0, r2); });
    });
  }

 private:
  template <int lanes, class Near>
  DECANT_DEVICE void test(Float3 x, const float4* positions, Candidates::Run run, Near&& near) const {
    for (int k = run.begin; k < run.end; k += lanes) {
      const int j = run.listed ? run.listed[k] : k;
      const float4 other = positions[j];
      const Float3 d = nearest_image<periodic>(c, x - xyz(other));
      const float r2 = dot(d, d);
      if (r2 < c.H2) near(j, other, d, r2);
    }
  }
};

/// Neighbor lists, fluid and wall alike: near a wall its particles take the place of the missing fluid,
/// so one short capacity serves both. Each thread that works on a particle has a list of its own. Four
/// entries are one word; words of the threads of a warp lie side by side, so that it reads whole lines of
/// memory. The last word is filled up with `sentinel`, a point far from everything.
struct Lists {
#ifdef __CUDACC__
  static constexpr int beside = 32;
#else
  static constexpr int beside = 1;
#endif
  // Word w of thread t = i × lanes + lane is at (⌊t/beside⌋ × capacity/4 + w) × beside + t mod beside.
  int4* word;
  int lanes;
  int capacity;  // entries per thread, a multiple of 4
  int sentinel;
  int* count;  // [n × lanes]; more than capacity: the list is cut, and useless

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
    return count[static_cast<std::size_t>(i) * static_cast<std::size_t>(lanes) + static_cast<std::size_t>(lane)];
  }
};

template <bool periodic>
struct ListNeighbors : WeightsInPositions {
  Lists lists;

  template <class Team, class Visit>
  DECANT_DEVICE void for_each(Team& team, const Float3 (&x)[1], const float4* positions, Visit&& visit) const {
    const int i = team.particle(0), listed = lists.count_of(i, team.lane());
    const int words = ((listed < lists.capacity ? listed : lists.capacity) + 3) / 4;
    if (words == 0) return;
    const int4* from = lists.words(i, team.lane());
    const auto word = [&](int w) DECANT_INLINE {
      return w < words ? from[w * Lists::beside]
                       : make_int4(lists.sentinel, lists.sentinel, lists.sentinel, lists.sentinel);
    };
    // What comes next is on its way while this word is worked on: the next word, and where a thread has
    // a particle to itself, so that there are few others to wait for, that one's positions as well.
    if constexpr (Team::lanes > 1 || !gathers_ahead) {
      float4 now_positions[4];
      int4 next = word(0);
#pragma unroll 1
      for (int w = 0; w < words; ++w) {
        const int4 now = next;
        next = word(w + 1);
        gather(positions, now, now_positions);
        use(x[0], now, now_positions, visit);
      }
    } else {
      int w = 0;
      int4 even = word(0), odd = word(1);
      float4 even_positions[4], odd_positions[4];
      const auto step = [&](int4& now, const float4(&now_positions)[4], int4 next, float4(&next_positions)[4])
                            DECANT_INLINE {
                              gather(positions, next, next_positions);
                              const int4 j = now;
                              now = word(w + 2);
                              use(x[0], j, now_positions, visit);
                              return ++w < words;
                            };
      gather(positions, even, even_positions);
#pragma unroll 1
      while (step(even, even_positions, odd, odd_positions) && step(odd, odd_positions, even, even_positions)) {
      }
    }
  }

 private:
#ifdef __CUDACC__
  static constexpr bool gathers_ahead = true;
#else
  static constexpr bool gathers_ahead = false;
#endif
  DECANT_DEVICE static void gather(const float4* positions, int4 j, float4 (&to)[4]) {
    to[0] = positions[j.x];
    to[1] = positions[j.y];
    to[2] = positions[j.z];
    to[3] = positions[j.w];
  }
  template <class Visit>
  DECANT_DEVICE void use(Float3 x, int4 word, const float4 (&positions)[4], Visit&& visit) const {
    const int j[4] = {word.x, word.y, word.z, word.w};
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      const Float3 d = nearest_image<periodic>(c, x - xyz(positions[k]));
      // In a periodic scene nothing is far from everything.
      const bool there = !periodic || j[k] != lists.sentinel;
      visit(0, j[k], positions[k], d, there ? dot(d, d) : 4.0f * c.H2);
    }
  }
};

/// The lists of all threads of a particle, read by one.
template <bool periodic>
struct WholeListNeighbors : WeightsInPositions {
  Lists lists;

  template <class Team, class Visit>
  DECANT_DEVICE void for_each(Team& team, const Float3 (&x)[1], const float4* positions, Visit&& visit) const {
    const ListNeighbors<periodic> part{{this->c}, lists};
    for (int lane = 0; lane < lists.lanes; ++lane) {
      const OneOf one{team.particle(0), lane};
      part.for_each(one, x, positions, visit);
    }
  }

 private:
  struct OneOf {
    static constexpr int lanes = 2;  // of several, so that little is read ahead
    int i, number;
    DECANT_DEVICE int particle(int) const { return i; }
    DECANT_DEVICE int lane() const { return number; }
  };
};

}  // namespace
}  // namespace decant::gpu
