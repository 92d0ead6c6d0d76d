/// \file
/// Density by summation, ρ_i = Σ w_j W_ij over fluid and wall particles, itself included, and the pressure that
/// follows from it. Every particle leaves what its neighbors read in the force kernel: p/ρ² and 1/ρ.
#pragma once

#include "gpu/core/teams.cuh"
#include "gpu/physics/equation_of_state.cuh"
#include "gpu/physics/sph_kernels.cuh"

namespace decant::gpu {
namespace {

/// Once per substep, beside the densities. In an evaluation, which has the poses of its time alone, nothing moves.
struct BeginSubstep {
  ParticleArrays a;
  bool moves;

  DECANT_DEVICE void operator()() const {
    ++a.status->substeps_begun;
    const DevicePose* poses = a.poses_after();
    float step = 0.0f;
    for (int k = 0; k < a.containers && moves; ++k) step = fmaxf(step, poses[k].step);
    a.status->wall_step = step;
    a.status->wall_displacement += step;
  }
};

/// ρ, p and what the force of a neighbor asks of a particle, p/ρ² and 1/ρ.
struct DensityResult {
  float density, pressure, pressure_term, inverse_density;
};

/// Leaves what neighbors read, and the fields of an evaluation.
struct StoreDensity {
  OutputArrays out;

  DECANT_DEVICE void operator()(const ParticleArrays& a, int i, Float3 x, const DensityResult& found) const {
    const float4 v = a.current.velocity[i];
    a.force_position[i] = make_float4(x.x, x.y, x.z, found.pressure_term);
    a.force_velocity[i] = make_float4(v.x, v.y, v.z, found.inverse_density);
    if (!out.density) return;
    const int id = a.id[i];
    out.density[id] = found.density;
    out.pressure[id] = found.pressure;
  }
};

/// then(a, i, x, DensityResult) for every particle.
template <class Neighbors, class Then = StoreDensity>
struct Density {
  Constants c;
  ParticleArrays a;
  Neighbors neighbors;
  Then then;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::particles_per_thread];
    float sum[Team::particles_per_thread];
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) x[k] = xyz(a.current.position[team.particle(k)]);
    with_kernel(c, [&](auto kernel) DECANT_INLINE {
      // The particle itself is counted once.
      const float own = team.is_leader() ? c.mass * kernel.w(c, {0.0f, 0.0f}) : 0.0f;
#pragma unroll
      for (int k = 0; k < Team::particles_per_thread; ++k) sum[k] = own;
      neighbors.for_each(team, x, a.current.position, [&](int k, int j, float4 other, Float3, float r2) DECANT_INLINE {
        sum[k] += neighbors.weight(j, other) * kernel.w(c, radius(r2));
      });
    });
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) finish(team, k, x[k], sum[k]);
  }

 private:
  template <class Team>
  DECANT_DEVICE void finish(Team& team, int k, Float3 x, float sum) const {
    const float density = team.sum(sum);
    if (!team.active(k) || !team.is_leader()) return;
    const float p = pressure_at(c, density);
    then(a, team.particle(k), x, {density, p, p / (density * density), 1.0f / density});
  }
};

template <class Team, class Neighbors>
DECANT_KERNEL(Team::block_size, Team::blocks_per_multiprocessor)
density_kernel(int n, Density<Neighbors> density) {
  once(BeginSubstep{density.a, !density.then.out.density});
  for_each_team<Team>(n, density);
}

/// p/ρ² and 1/ρ from density and pressure given from outside, by the id of the problem; and the pressure that follows from that
/// density, which stands in for one that is not given.
struct UseGivenDensity {
  Constants c;
  ParticleArrays a;
  const float *density, *pressure;  // pressure null: not given
  float* own_pressure;

  DECANT_DEVICE void operator()(int i) const {
    const int id = a.id[i];
    const int given = a.problem_id(id);
    const float own = pressure_at(c, density[given]);
    own_pressure[id] = own;
    a.force_position[i].w = (pressure ? pressure[given] : own) / (density[given] * density[given]);
    a.force_velocity[i].w = 1.0f / density[given];
  }
};
DECANT_KERNEL(256) use_given_density_kernel(int n, UseGivenDensity use) { for_each_thread(n, use); }

}  // namespace
}  // namespace decant::gpu
