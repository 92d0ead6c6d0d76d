/// \file
/// What one neighbor adds to the acceleration of a particle. With w_j = m and ν_j = μ m/ρ_j of fluid, w_b = ρ0 V_b
/// and ν_b = μ_w V_b of a wall particle, q = p/ρ² and x_ij = x_i − x_j:
///   a_i = Σ w_j (q_i + q_j) G x_ij + (1/ρ_i) Σ ν_j (v_j − v_i) L + g
/// (Monaghan 1992; Morris et al. 1997; walls: Akinci et al. 2012, with the density of rest and no pressure of
/// their own.)
#pragma once

#include "gpu/physics/sph_kernels.cuh"

namespace decant::gpu {
namespace {

/// Of the particle itself.
struct ForceState {
  Float3 v;
  float q, inverse_density;
};

/// The two sums' terms; the viscous one still without 1/ρ_i.
struct PairForce {
  Float3 pressure, viscous;
};

/// ν_j ρ_j of fluid, the same for all pairs.
DECANT_DEVICE float fluid_drag(const Constants& c) { return c.viscosity * c.mass; }

/// \param fluid_drag  fluid_drag(c)
/// \param q           p/ρ² of the neighbor
/// \param other       its velocity, and 1/ρ, of a wall particle V_b
template <class Kernel>
DECANT_DEVICE PairForce pair_force(const Constants& c, Kernel kernel, float fluid_drag, const ForceState& own,
                                   bool wall, float q, float4 other, Float3 d, float r2) {
  const Radius r = radius(r2);
  const float g = kernel.g(c, r);
  const float weight = wall ? c.rest_density * other.w : c.mass;
  const float drag = other.w * (wall ? c.wall_viscosity : fluid_drag);
  return {(weight * (own.q + q) * g) * d, (drag * kernel.l(c, r, r2, g)) * (xyz(other) - own.v)};
}

}  // namespace
}  // namespace decant::gpu
