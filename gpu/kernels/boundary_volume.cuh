/// \file
/// The volume that a wall particle stands for (Akinci et al. 2012, eq. 4).
#pragma once

#include "gpu/kernels/place_walls.cuh"
#include "gpu/physics/sph_kernels.cuh"

namespace decant::gpu {
namespace {

/// V_b = 1 / Σ_k W_bk over the wall particles of the same container, itself included, by id.
template <class Neighbors>
struct BoundaryVolume {
  Constants c;
  ParticleArrays a;
  Neighbors neighbors;
  Walls walls;
  int container, begin;  // its first slot

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::particles_per_thread];
    float sum[Team::particles_per_thread];
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      x[k] = xyz(a.current.position[a.base + begin + team.particle(k)]);
      sum[k] = 0.0f;
    }
    with_kernel(c, [&](auto kernel) DECANT_INLINE {
      neighbors.for_each_of_container(team, container, x, a.current.position,
                                      [&](int k, float r2) DECANT_INLINE { sum[k] += kernel.w(c, radius(r2)); });
    });
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      const float total = team.sum(sum[k]);
      if (team.active(k) && team.is_leader()) walls.volume[walls.id[begin + team.particle(k)]] = 1.0f / total;
    }
  }
};
template <class Team, class Neighbors>
DECANT_KERNEL(Team::block_size, Team::blocks_per_multiprocessor)
boundary_volume_kernel(int n, BoundaryVolume<Neighbors> volume) {
  for_each_team<Team>(n, volume);
}

}  // namespace
}  // namespace decant::gpu
