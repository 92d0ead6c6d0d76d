/// \file
/// What a substep does in tiles (tile_memory.cuh).
#pragma once

#include "gpu/kernels/density.cuh"
#include "gpu/kernels/force.cuh"
#include "gpu/kernels/tile_memory.cuh"

namespace decant::gpu {
namespace {

struct UseTile : TileSet {
  /// Fluid as it is at the start of a substep, and the walls that have moved.
  DECANT_DEVICE void load_state(const PersistentBlock& block, const TileMemory& tile) const {
    struct State {
      float4 x, v;
    };
    block.template copy<2>(
        tile.header->fluid,
        [&](int l) DECANT_INLINE {
          const int j = tile.index[l];
          return State{a.current.position[j], a.current.velocity[j]};
        },
        [&](int l, const State& s) DECANT_INLINE {
          tile.position[l] = make_float4(s.x.x, s.x.y, s.x.z, 0.0f);
          tile.velocity[l] = make_float4(s.v.x, s.v.y, s.v.z, 0.0f);
        });
    block.for_each(tile.header->moving_end - tile.header->moving_begin, [&](int k) DECANT_INLINE {
      const int l = tile.header->moving_begin + k;
      const float4 wall = tile.moving[k];
      const DevicePose& pose = tile.poses[static_cast<int>(wall.w)];
      const Float3 x = rotate(pose, xyz(wall)) + pose.translation;
      tile.position[l] = make_float4(x.x, x.y, x.z, 0.0f);
      tile.velocity[l] = wall_velocity(pose, x, tile.velocity[l].w);
    });
    block.sync();
  }
  /// What the densities of all particles have left, and what the integration needs.
  DECANT_DEVICE void load_terms(const PersistentBlock& block, const TileMemory& tile) const {
    block.once([&] {
      tile.header->wall_step = a.status->wall_step;
      tile.header->wall_displacement = a.status->wall_displacement;
      tile.header->skin = a.status->skin;
    });
    load_poses(block, tile, a.poses_after());
    block.template copy<2>(
        tile.header->fluid, [&](int l) DECANT_INLINE { return terms[tile.index[l]]; },
        [&](int l, float2 term) DECANT_INLINE {
          tile.position[l].w = term.x;
          tile.velocity[l].w = term.y;
        });
    block.sync();
  }
  /// The arrays as kernels see them that run over a tile's particles, by local index.
  DECANT_DEVICE ParticleArrays local_arrays(const TileMemory& tile) const {
    ParticleArrays local = a;
    local.current.position = local.force_position = tile.position;
    local.current.velocity = local.force_velocity = tile.velocity;
    local.base = tile.header->fluid;
    return local;
  }
  /// The lists where other kernels read them, after an advance.
  DECANT_DEVICE void store_lists(const PersistentBlock& block, const TileMemory& tile) const {
    block.for_each(tile.threads, [&](int t) DECANT_INLINE {
      const int i = tile.index[tile.own[t / lanes]], lane = t % lanes, words = tile.length[t];
      lists.count_of(i, lane) = 4 * words;
      if (4 * words > lists.capacity) {
        atomic_maximum(&a.status->longest_list, 4 * words);
        return;
      }
      int4* to = lists.words(i, lane);
      for (int w = 0; w < words; ++w, to += Lists::beside) {
        const uint2 j = tile.list[w * tile.threads + t];
        *to =
            make_int4(tile.index[j.x & 0xFFFF], tile.index[j.x >> 16], tile.index[j.y & 0xFFFF], tile.index[j.y >> 16]);
      }
    });
  }
};

/// Lists of a tile: those of particle `owned` of the block's own.
struct TileNeighbors : WeightsInPositions {
  TileMemory tile;
  int owned;

  DECANT_DEVICE float weight(int j, float4) const {
    return j < tile.header->fluid ? c.mass : c.rest_density * tile.velocity[j].w;
  }

  template <class Team, class Visit>
  DECANT_DEVICE void for_each(Team& team, const Float3 (&x)[1], const float4* positions, Visit&& visit) const {
    const int t = owned * Team::lanes + team.lane(), words = tile.length[t];
    const uint2* from = tile.list + t;
    uint2 next = words > 0 ? *from : uint2{};
#pragma unroll 1
    for (int w = 0; w < words; ++w) {
      const unsigned j[4] = {next.x & 0xFFFF, next.x >> 16, next.y & 0xFFFF, next.y >> 16};
      from += tile.threads;
      if (w + 1 < words) next = *from;
      float4 other[4];
#pragma unroll
      for (int k = 0; k < 4; ++k) other[k] = positions[j[k]];
#pragma unroll
      for (int k = 0; k < 4; ++k) {
        const Float3 d = x[0] - xyz(other[k]);
        visit(0, static_cast<int>(j[k]), other[k], d, dot(d, d));
      }
    }
  }
};

/// Of particle `index`, for other blocks.
struct StoreDensityTerms {
  float2* terms;
  int index;

  DECANT_DEVICE void operator()(const ParticleArrays&, int, Float3, const DensityResult& found) const {
    terms[index] = make_float2(found.pressure_term, found.inverse_density);
  }
};

/// Of particle `owned` of the block's own.
template <class Integrate>
struct IntegrateOwned {
  const Integrate& integrate;
  TileMemory tile;
  int owned;

  static constexpr bool by_team = true;
  template <class Team>
  DECANT_DEVICE void operator()(const Team& team, int, Float3 x, Float3 v, Float3 acceleration) const {
    float4& origin = tile.origin[owned];
    auto moved = integrate.move(x, v, acceleration, origin.w, tile.header->wall_step);
    if (integrate.may_touch(moved)) integrate.touch(team, tile.poses, moved);
    team.sync();  // all have read the clearance
    if (!team.is_leader()) return;
    integrate.store(tile.index[tile.own[owned]], moved,
                    {origin, sound_skin(tile.header->skin), tile.header->wall_displacement});
    origin.w = moved.clearance;
  }
};

}  // namespace
}  // namespace decant::gpu
