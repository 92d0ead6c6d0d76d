/// \file
/// Brute force: every particle looks at every other, tile by tile. No structure to build, none to be
/// wrong; the slowest backend and the one the others are first compared with.
///
/// What costs is the test of a pair. |x_i − x_j|² < H² is first asked as w_j − 2 x_i·x_j < H² − |x_i|²
/// with w_j = |x_j|² stored beside the point: three multiply-adds. That form cancels, so its bound is
/// widened by what fp32 can lose, 16u(|x_i| + H)², and what passes is asked again exactly; the filter
/// never decides. Sixteen pairs share one branch, because hits are rare (one in thousands).
#pragma once

#include "gpu/pipeline.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

template <bool periodic>
struct BruteQuery {
  Constants c;
  int base, all_end;           // wall particles begin, and all padding ends
  const float4* squares;       // positions with |x|², whatever else the pass reads
  const float4* with_pressure;  // Arrays::point
  const float4* with_volume;    // Arrays::motion
  const WallSegment* segments;

  template <class Team, class Visit>
  DECANT_DEVICE void each(Team& team, int i, Float3 x, const float4*, Visit&& visit) const {
    sweep(team, squares, 0, all_end, x, [&](int j, Float3 d, float r2) {
      if (j != i) visit(j, float4{}, d, r2);
    });
  }
  /// What points carry is |x|²; the rest is fetched for the few that are near.
  DECANT_DEVICE float weight(int j, float4) const {
    return j < base ? c.mass : c.rest_density * with_volume[j].w;
  }
  DECANT_DEVICE float pressure_term(int j, float4) const { return with_pressure[j].w; }

  template <class Team, class Visit>
  DECANT_DEVICE void of_segment(Team& team, int k, Float3 x, const float4*, Visit&& visit) const {
    const WallSegment& s = segments[k];
    sweep(team, squares, base + s.begin, base + padded(s.end), x,
          [&](int b, Float3 d, float r2) { visit(b, float4{}, d, r2); });
  }

 private:
  static constexpr int batch = 16;

  template <class Team, class Visit>
  DECANT_DEVICE void sweep(Team& team, const float4* all, int begin, int end, Float3 x,
                           Visit&& visit) const {
    const float squared = dot(x, x), reach = sqrtf(squared) + c.H;
    const float bound = c.H2 - squared + 16.0f * 0x1p-24f * (reach * reach);
    const Float3 back = -2.0f * x;
    team.tiles(all, begin, end, [&](int first, const float4* tile) {
      for (int k = team.lane(); k < tile_size; k += batch * tile_lanes) {
        if constexpr (!periodic) {
          float least = 3.0e38f;
#pragma unroll
          for (int s = 0; s < batch; ++s) {
            const float4 p = tile[k + s * tile_lanes];
            least = lesser(back.x * p.x + (back.y * p.y + (back.z * p.z + p.w)), least);
          }
          if (!(least < bound)) continue;
        }
        for (int s = 0; s < batch; ++s) {
          const Float3 d = nearest_image<periodic>(c, x - xyz(tile[k + s * tile_lanes]));
          const float r2 = dot(d, d);
          if (r2 < c.H2) visit(first + k + s * tile_lanes, d, r2);
        }
      }
    });
  }
};

/// For Pipeline: nothing is built, the arrays are enough.
class BruteSearch {
 public:
  explicit BruteSearch(const SolverOptions&) {}

  static constexpr bool points_carry_square = true;

  void load(Queue& queue, const Constants& c, const Arrays& a, const WallStore& walls,
            const std::vector<float>&) {
    c_ = c;
    walls_ = walls;
    end_ = a.base + walls.padded_total();
    queue.for_each(walls.padded_total(), UnposedPass{a, walls.walls});
    segments_.upload(walls.segments);
    for (std::size_t k = 0; k < walls.segments.size(); ++k)
      with_periodic(c_, [&](auto periodic) {
        using Query = BruteQuery<decltype(periodic)::value>;
        const WallSegment& s = walls.segments[k];
        queue.for_each_tile_team(s.end - s.begin,
                                 VolumePass<Query>{c_, a, query<Query>(a), walls.walls,
                                                   static_cast<int>(k), s.begin});
      });
  }
  void arrange(Arrays& a, const Particles& state, const Particles&) const {
    a.now = state;
    a.next = state;
  }
  void begin(Queue&, const Arrays&) {}
  bool capturable() const { return false; }

  template <bool periodic, bool facts>
  void density(Queue& queue, const Arrays& a, const DeviceGeometry&, const FieldArrays& out,
               const Laps& laps) {
    using Query = BruteQuery<periodic>;
    queue.for_each(1, CountUp{&a.mailbox->substep});
    laps.build();
    queue.for_each_tile_team(
        a.n, DensityPass<Query, facts>{c_, a, query<Query>(a), out, walls_.walls.id});
    laps.density();
  }
  template <bool periodic, bool facts>
  void force(Queue& queue, const Arrays& a, const FieldArrays& out, const Laps& laps) {
    using Query = BruteQuery<periodic>;
    queue.for_each_tile_team(a.n, ForcePass<Query, facts>{c_, a, query<Query>(a), out});
    laps.force();
  }
  template <bool periodic>
  void move(Queue& queue, const Arrays& a, const DeviceGeometry& geometry, const Laps& laps) {
    queue.for_each(a.n + walls_.moving_count(),
                   IntegratePass<Nothing>{c_, a, geometry, walls_.moving(a), {}});
    laps.integrate();
  }
  bool grow(int) { return false; }
  std::size_t bytes() const { return segments_.bytes(); }

 private:
  template <class Query>
  Query query(const Arrays& a) const {
    return {c_, a.base, end_, a.now.position, a.point, a.motion, segments_.get()};
  }

  Constants c_{};
  WallStore walls_{};
  Buffer<WallSegment> segments_;
  int end_ = 0;
};

}  // namespace decant::gpu::DECANT_EXECUTOR
