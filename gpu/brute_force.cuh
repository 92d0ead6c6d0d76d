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
  const float4 *points, *walls, *walls_local;
  int padded_points, padded_walls;

  template <class Team, class Visit>
  DECANT_DEVICE void fluid(Team& team, Float3 x, Visit&& visit) const {
    sweep(team, points, padded_points, x, visit);
  }
  template <class Team, class Visit>
  DECANT_DEVICE void wall(Team& team, Float3 x, Visit&& visit) const {
    sweep(team, walls, padded_walls, x, visit);
  }
  template <class Team, class Visit>
  DECANT_DEVICE void wall_frame(Team& team, Float3 x, Visit&& visit) const {
    sweep(team, walls_local, padded_walls, x, visit);
  }

 private:
  static constexpr int batch = 16;

  template <class Team, class Visit>
  DECANT_DEVICE void sweep(Team& team, const float4* all, int count, Float3 x,
                           Visit& visit) const {
    const float squared = dot(x, x), reach = sqrtf(squared) + c.H;
    const float bound = c.H2 - squared + 16.0f * 0x1p-24f * (reach * reach);
    const Float3 back = -2.0f * x;
    team.tiles(all, count, [&](int first, const float4* tile) {
      for (int k = team.lane(); k < tile_size; k += batch * lanes) {
        if constexpr (!periodic) {
          float least = 3.0e38f;
#pragma unroll
          for (int s = 0; s < batch; ++s) {
            const float4 p = tile[k + s * lanes];
            least = lesser(back.x * p.x + (back.y * p.y + (back.z * p.z + p.w)), least);
          }
          if (!(least < bound)) continue;
        }
        for (int s = 0; s < batch; ++s) {
          const Float3 d = nearest_image<periodic>(c, x - xyz(tile[k + s * lanes]));
          const float r2 = dot(d, d);
          if (r2 < c.H2) visit(first + k + s * lanes, d, r2);
        }
      }
    });
  }
};

/// For Pipeline: nothing is built, the arrays are enough.
struct BruteSearch {
  template <bool periodic>
  using Query = BruteQuery<periodic>;

  template <bool periodic>
  Query<periodic> query(const Constants& c, const Arrays& a) const {
    return {c, a.position, a.wall, a.wall_local, padded(a.n), padded(a.m)};
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
