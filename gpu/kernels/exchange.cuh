/// \file
/// What ranks send each other in every substep, of particles that others have copies of (ghosts): p/ρ² and 1/ρ
/// after the densities, position and velocity after the integration. Lists hold ids of this rank, in the order of
/// the problem's ids on both sides.
#pragma once

#include "gpu/core/teams.cuh"
#include "gpu/physics/vectors.cuh"

namespace decant::gpu {
namespace {

/// What ranks do around an integration: nothing, where there is one. `start` moves what others wait for and sends it;
/// after `finish` ghosts are where they are now.
struct NoExchange {
  template <class Integrate>
  void start(const Integrate&) const {}
  template <class After>
  void finish(const After&) const {}
};

/// What neighbors read of a particle in the force kernel beside its state.
struct DensityTerms {
  float pressure_term, inverse_density;  // p/ρ², 1/ρ
};

struct PackDensities {
  ParticleArrays a;
  const int* list;
  DensityTerms* to;

  DECANT_DEVICE void operator()(int k) const {
    const int i = a.index[list[k]];
    to[k] = {a.force_position[i].w, a.force_velocity[i].w};
  }
};
DECANT_KERNEL(256) pack_densities_kernel(int n, PackDensities pack) { for_each_thread(n, pack); }

struct UnpackDensities {
  ParticleArrays a;
  const int* list;
  const DensityTerms* from;

  DECANT_DEVICE void operator()(int k) const {
    const int i = a.index[list[k]];
    a.force_position[i].w = from[k].pressure_term;
    a.force_velocity[i].w = from[k].inverse_density;
  }
};
DECANT_KERNEL(256) unpack_densities_kernel(int n, UnpackDensities unpack) { for_each_thread(n, unpack); }

struct GhostState {
  float4 position, velocity;
};

struct PackStates {
  ParticleArrays a;
  const int* list;
  GhostState* to;

  DECANT_DEVICE void operator()(int k) const {
    const int i = a.index[list[k]];
    to[k] = {a.next.position[i], a.next.velocity[i]};
  }
};
DECANT_KERNEL(256) pack_states_kernel(int n, PackStates pack) { for_each_thread(n, pack); }

/// after: what the search does with every particle's new position (Integrate::after).
template <class After>
struct UnpackStates {
  ParticleArrays a;
  const int* list;
  const GhostState* from;
  After after;

  DECANT_DEVICE void operator()(int k) const {
    const int i = a.index[list[k]];
    const auto prefetched = after.prefetch(i);
    a.next.position[i] = from[k].position;
    a.next.velocity[i] = from[k].velocity;
    after(i, xyz(from[k].position), prefetched);
  }
};
template <class After>
DECANT_KERNEL(256)
unpack_states_kernel(int n, UnpackStates<After> unpack) {
  for_each_thread(n, unpack);
}

}  // namespace
}  // namespace decant::gpu
