/// \file
/// Acceleration by pressure, viscosity, walls and gravity (physics/pair_terms.cuh), and what becomes of it:
/// stored for the integration kernel, or used at once where a kernel integrates as well.
#pragma once

#include "gpu/core/teams.cuh"
#include "gpu/physics/pair_terms.cuh"

namespace decant::gpu {
namespace {

/// Keeps accelerations for a kernel of its own, or in the output of an evaluation, which needs the positions that
/// they lie over.
struct StoreAcceleration {
  ParticleArrays a;
  OutputArrays out;
  static constexpr bool by_team = false;

  DECANT_DEVICE void operator()(int i, Float3 x, Float3, Float3 acceleration) const {
    if (!out.acceleration) {
      a.acceleration[i] = make_float4(acceleration.x, acceleration.y, acceleration.z, 0.0f);
      return;
    }
    const int id = a.id[i];
    // A position that is no number is nobody's neighbor, and falls as if it were alone.
    if (!is_finite(acceleration) || !is_finite(x)) report(&a.status->non_finite, 0, id);
    store(out.acceleration, id, acceleration);
  }
};

DECANT_DEVICE ForceState force_state(const ParticleArrays& a, int i, Float3& x) {
  const float4 position = a.force_position[i], velocity = a.force_velocity[i];
  x = xyz(position);
  return {xyz(velocity), position.w, velocity.w};
}

/// add(k, wall, f) with the pair force f of every neighbor of each particle team.particle(k), which is at x[k].
template <class Team, class Neighbors, class Add>
DECANT_DEVICE void for_each_pair_force(const Constants& c, const ParticleArrays& a, const Neighbors& neighbors,
                                       Team& team, const Float3 (&x)[Team::particles_per_thread],
                                       const ForceState (&own)[Team::particles_per_thread], Add&& add) {
  const float drag = fluid_drag(c);
  with_kernel(c, [&](auto kernel) DECANT_INLINE {
    neighbors.for_each(team, x, a.force_position, [&](int k, int j, float4 other, Float3 d, float r2) DECANT_INLINE {
      const bool wall = j >= a.base;
      add(k, wall,
          pair_force(c, kernel, drag, own[k], wall, neighbors.pressure_term(j, other), a.force_velocity[j], d, r2));
    });
  });
}

/// then(i, x, v, acceleration) for every particle, or then(team, i, …) by all threads that work on it.
template <class Neighbors, class Then>
struct Force {
  Constants c;
  ParticleArrays a;
  Neighbors neighbors;
  Then then;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::particles_per_thread];
    ForceState own[Team::particles_per_thread];
    PairForce sum[Team::particles_per_thread];
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      own[k] = force_state(a, team.particle(k), x[k]);
      sum[k] = {};
    }
    for_each_pair_force(c, a, neighbors, team, x, own,
                        [&](int k, [[maybe_unused]] bool wall, const PairForce& f) DECANT_INLINE {
                          sum[k].pressure = sum[k].pressure + f.pressure;
                          sum[k].viscous = sum[k].viscous + f.viscous;
                        });
#pragma unroll
    for (int k = 0; k < Team::particles_per_thread; ++k) {
      const Float3 part = sum[k].pressure + own[k].inverse_density * sum[k].viscous;
      const Float3 acceleration = Float3{team.sum(part.x), team.sum(part.y), team.sum(part.z)} + c.gravity;
      if constexpr (Then::by_team) then(team, team.particle(k), x[k], own[k].v, acceleration);
      else if (team.active(k) && team.is_leader()) then(team.particle(k), x[k], own[k].v, acceleration);
    }
  }
};

template <class Team, class Neighbors>
DECANT_KERNEL(Team::block_size, Team::blocks_per_multiprocessor)
force_kernel(int n, Force<Neighbors, StoreAcceleration> force) {
  for_each_team<Team>(n, force);
}

}  // namespace
}  // namespace decant::gpu
