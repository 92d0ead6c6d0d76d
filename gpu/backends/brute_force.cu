/// \file
/// Brute force: every particle looks at every other, tile by tile. No structure to build, none to be
/// wrong; the slowest backend and the one the others are first compared with.
///
/// What costs is the test of a pair. |x_i − x_j|² < H² is first asked as w_j − 2 x_i·x_j < H² − |x_i|²
/// with w_j = |x_j|² stored with the position: three multiply-adds. That form cancels, so its bound is
/// widened by what fp32 can lose, 16u(|x_i| + H)², and what passes is asked again exactly; the filter
/// never decides. Pairs of a batch share one branch, because hits are rare (one in thousands), and batches
/// with a hit are put off: threads then evaluate theirs together instead of waiting for each other.
#include "gpu/backends/all_particles.cuh"

namespace decant::gpu {
namespace {

#ifndef __CUDACC__
/// The host's filter, by vectors of particles: the left sides above for a batch of positions, the least per particle.
/// Neither form contracts or reorders, so that all processors give the same bits.
inline constexpr int batch_positions = 16;
struct TileVectors {
  float x[tile_particles_per_thread], y[tile_particles_per_thread], z[tile_particles_per_thread];  // −2 x_i
};
[[gnu::always_inline]] inline void find_least(const TileVectors& back, const float4* positions, float* least) {
  for (int s = 0; s < batch_positions; ++s) {
    const float4 p = positions[s];
#pragma omp simd
    for (int k = 0; k < tile_particles_per_thread; ++k) {
      const float side = back.x[k] * p.x + (back.y[k] * p.y + (back.z[k] * p.z + p.w));
      least[k] = side < least[k] ? side : least[k];
    }
  }
}
void find_least_plain(const TileVectors& back, const float4* positions, float* least) {
  find_least(back, positions, least);
}
#ifdef __x86_64__
[[gnu::target("avx2")]] void find_least_avx2(const TileVectors& back, const float4* positions, float* least) {
  find_least(back, positions, least);
}
#endif
auto chosen_find_least() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) return find_least_avx2;
#endif
  return find_least_plain;
}
#endif

template <bool periodic>
struct BruteNeighbors {
  Constants c;
  int base, all_end;             // wall particles begin, and all padding ends
  const float4* squares;         // positions with |x|², whatever else the kernel reads
  const float4* force_position;  // as in ParticleArrays
  const float4* force_velocity;
  const WallSegment* segments;

  using Team = TileTeam;
  static constexpr bool stores_square = true;
  static BruteNeighbors of(const Constants& c, const ParticleArrays& a, int all_end, const WallSegment* segments) {
    return {c, a.base, all_end, a.current.position, a.force_position, a.force_velocity, segments};
  }

  template <class Team, class Visit>
  DECANT_DEVICE void for_each(Team& team, const Float3 (&x)[Team::particles_per_thread], const float4*,
                              Visit&& visit) const {
    sweep(team, squares, 0, all_end, x, [&](int k, int j, Float3 d, float r2) DECANT_INLINE {
      if (j != team.particle(k)) visit(k, j, float4{}, d, r2);
    });
  }
  /// What positions carry is |x|²; the rest is fetched for the few that are near.
  DECANT_DEVICE float weight(int j, float4) const { return j < base ? c.mass : c.rest_density * force_velocity[j].w; }
  DECANT_DEVICE float pressure_term(int j, float4) const { return force_position[j].w; }

  template <class Team, class Visit>
  DECANT_DEVICE void for_each_of_container(Team& team, int container, const Float3 (&x)[Team::particles_per_thread],
                                           const float4*, Visit&& visit) const {
    const WallSegment& s = segments[container];
    sweep(team, squares, base + s.begin, base + padded(s.end), x,
          [&](int k, int, Float3, float r2) DECANT_INLINE { visit(k, r2); });
  }

 private:
  static constexpr int batch = 16;
  static constexpr int batches_per_tile = tile_positions / (batch * tile_lanes) * tile_particles_per_thread;
  static constexpr int room = 2 * batches_per_tile;

  template <class Team, class Visit>
  DECANT_DEVICE void sweep(Team& team, const float4* all, int begin, int end,
                           const Float3 (&x)[Team::particles_per_thread], Visit&& visit) const {
    float bound[Team::particles_per_thread];
    Float3 back[Team::particles_per_thread];
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      const float squared = dot(x[k], x[k]), reach = sqrtf(squared) + c.H;
      bound[k] = c.H2 - squared + 16.0f * 0x1p-24f * (reach * reach);
      back[k] = -2.0f * x[k];
    }
#ifndef __CUDACC__
    static_assert(batch == batch_positions);
    const auto find = chosen_find_least();
    TileVectors sides;
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      sides.x[k] = back[k].x;
      sides.y[k] = back[k].y;
      sides.z[k] = back[k].z;
    }
#endif
    int put_off[room];  // first point × particles_per_thread + k
    int waiting = 0;
#pragma unroll 1
    for (int first = begin;; first += tile_positions) {
      if (first >= end || waiting > room - batches_per_tile) {
#pragma unroll 1
        for (; waiting > 0; --waiting) {
          const int k = put_off[waiting - 1] % Team::particles_per_thread,
                    from = put_off[waiting - 1] / Team::particles_per_thread;
#pragma unroll 1
          for (int j = from; j < from + batch * tile_lanes && j < end; j += tile_lanes) {
            const Float3 d = nearest_image<periodic>(c, x[k] - xyz(all[j]));
            const float r2 = dot(d, d);
            if (r2 < c.H2) visit(k, j, d, r2);
          }
        }
      }
      if (first >= end) break;
      const float4* tile = team.tile(all, first, end);
      const int positions = end - first < tile_positions ? end - first : tile_positions;
#pragma unroll 1
      for (int at = team.lane(); at < positions; at += batch * tile_lanes) {
        float least[Team::particles_per_thread];
#pragma unroll
        for (int k = 0; k < Team::particles_per_thread; ++k) least[k] = periodic ? bound[k] - 1.0f : 3.0e38f;
        if constexpr (!periodic) {
#ifdef __CUDACC__
#pragma unroll
          for (int s = 0; s < batch; ++s) {
            const float4 p = tile[at + s * tile_lanes];
#pragma unroll
            for (int k = 0; k < Team::particles_per_thread; ++k)
              least[k] = lesser(back[k].x * p.x + (back[k].y * p.y + (back[k].z * p.z + p.w)), least[k]);
          }
#else
          find(sides, tile + at, least);
#endif
        }
        bool any = false;
#pragma unroll
        for (int k = 0; k < Team::particles_per_thread; ++k) any = any || least[k] < bound[k];
        if (!any) continue;
#pragma unroll
        for (int k = 0; k < Team::particles_per_thread; ++k)
          if (least[k] < bound[k]) put_off[waiting++] = (first + at) * Team::particles_per_thread + k;
      }
    }
  }
};

}  // namespace

std::unique_ptr<DeviceSolver> DECANT_EXECUTOR::make_brute(const SolverOptions& options) {
  return std::make_unique<Solver<AllParticles<BruteNeighbors>>>(options);
}

}  // namespace decant::gpu
