/// \file
/// What an evaluation tells beyond what a substep computes: how many neighbors each particle has and which, and
/// the parts of its acceleration. By the same ranges and pair terms as the density and force kernels.
#pragma once

#include "gpu/kernels/force.cuh"

namespace decant::gpu {
namespace {

/// Number of neighbors and sum of their ids, fluid and wall.
template <class Neighbors>
struct NeighborCounts {
  Constants c;
  ParticleArrays a;
  Neighbors neighbors;
  OutputArrays out;
  const int* wall_id;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::particles_per_thread];
    Count fluid[Team::particles_per_thread], wall[Team::particles_per_thread];
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      x[k] = xyz(a.current.position[team.particle(k)]);
      fluid[k] = wall[k] = {0, 0};
    }
    neighbors.for_each(team, x, a.current.position, [&](int k, int j, float4, Float3, float r2) DECANT_INLINE {
      if (!(r2 < c.H2)) return;
      if (j < a.base) add(fluid[k], a.problem_id(a.id[j]));
      else add(wall[k], wall_id[j - a.base]);
    });
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      const int fluid_count = team.sum(fluid[k].count), wall_count = team.sum(wall[k].count);
      const long long fluid_ids = team.sum(fluid[k].id_sum), wall_ids = team.sum(wall[k].id_sum);
      if (!team.active(k) || !team.is_leader()) continue;
      const int id = a.id[team.particle(k)];
      out.fluid_count[id] = fluid_count;
      out.fluid_id_sum[id] = fluid_ids;
      out.wall_count[id] = wall_count;
      out.wall_id_sum[id] = wall_ids;
    }
  }

 private:
  struct Count {
    int count;
    long long id_sum;
  };
  DECANT_DEVICE static void add(Count& to, int id) {
    ++to.count;
    to.id_sum += id;
  }
};

/// The two sums of the acceleration, from fluid and from wall particles.
template <class Neighbors>
struct ForceParts {
  Constants c;
  ParticleArrays a;
  Neighbors neighbors;
  OutputArrays out;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::particles_per_thread];
    ForceState own[Team::particles_per_thread];
    PairForce fluid[Team::particles_per_thread], wall[Team::particles_per_thread];
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      own[k] = force_state(a, team.particle(k), x[k]);
      fluid[k] = wall[k] = {};
    }
    for_each_pair_force(c, a, neighbors, team, x, own, [&](int k, bool of_wall, const PairForce& f) DECANT_INLINE {
      PairForce& sum = of_wall ? wall[k] : fluid[k];
      sum.pressure = sum.pressure + f.pressure;
      sum.viscous = sum.viscous + f.viscous;
    });
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      const Float3 parts[4] = {total(team, fluid[k].pressure), total(team, own[k].inverse_density * fluid[k].viscous),
                               total(team, wall[k].pressure), total(team, own[k].inverse_density * wall[k].viscous)};
      if (!team.active(k) || !team.is_leader()) continue;
      const int id = a.id[team.particle(k)];
      store(out.pressure_acceleration, id, parts[0]);
      store(out.viscous_acceleration, id, parts[1]);
      store(out.wall_pressure_acceleration, id, parts[2]);
      store(out.wall_viscous_acceleration, id, parts[3]);
    }
  }

 private:
  template <class Team>
  DECANT_DEVICE static Float3 total(const Team& team, Float3 v) {
    return {team.sum(v.x), team.sum(v.y), team.sum(v.z)};
  }
};

template <class Team, class Neighbors>
DECANT_KERNEL(Team::block_size)
neighbor_counts_kernel(int n, NeighborCounts<Neighbors> count) {
  for_each_team<Team>(n, count);
}
template <class Team, class Neighbors>
DECANT_KERNEL(Team::block_size)
force_parts_kernel(int n, ForceParts<Neighbors> parts) {
  for_each_team<Team>(n, parts);
}

}  // namespace
}  // namespace decant::gpu
