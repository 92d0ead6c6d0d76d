/// \file
/// How far a correct fp32 backend may be from the oracle, particle by particle, derived from the sums
/// it has to form and never tuned.
///
/// Legend: u = 2⁻²⁴; a sum of n terms, each with a few roundings inside, computed in fp32 in any
/// order differs from the exact one by about (√n + c) u Σ|t|(1 + κ), κ the term's own condition
/// (Higham, Accuracy and Stability of Numerical Algorithms, §3–4; √n instead of n: Higham & Mary,
/// SIAM J. Sci. Comput. 41 (2019), theorem 2.8). A radial function f(r) of a rounded distance has
/// κ = r|f'|/f. The constants: c = 6 where a term is one product (density: subtraction, square,
/// root, polynomial, product), c = 8 where it is a vector with a quotient (accelerations).
#pragma once

#include "oracle/fixture.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <vector>

namespace decant {

inline constexpr double unit_roundoff = 0x1p-24;

/// The oracle's fields with the tolerance of each value, laid out alike (integers: 0).
struct OracleAnswer {
  Fields fields;
  ConditionSums condition;
  Fields tolerance;
  /// Particles that own a pair too close to H for fp32 to place: their neighbor facts are left out.
  std::vector<bool> fluid_ambiguous, wall_ambiguous;  // N
  /// How many such particles a fluid of this density has at most (four times the expectation).
  std::int64_t most_fluid_ambiguous = 0, most_wall_ambiguous = 0;
};

/// What rigid walls keep whatever the fluid does, M, m³: V_b, tau(V_b) below, and V_b by the oracle's
/// source in fp32.
struct WallAnswer {
  Eigen::VectorXd volume, tolerance, float_volume;
};
WallAnswer wall_answer(const Scene& scene, const Walls& walls);

/// Fields, condition sums and tolerances at one state. X_b below is the largest magnitude that the
/// pose of wall particle b passes through; q = p/rho²; c a component of the acceleration; every
/// n counts self.
///
///   tau(V_b) = V_b² (√n + 6) u Σ (W + r|W'|) + 2 u V_b
///   tau_rho = (√n + 6) u [C + Σ rho0 V_b |W'| X_b] + Σ rho0 tau(V_b) W
///   tau_p = c0² (rho/rho0)^(gamma−1) tau_rho + 20 u B (rho/rho0)^gamma + 3 u max(−p, 0), 0 where p
///           is certainly clamped; the last term, B, difference and product, is that of tension in
///           thin fluid, where the power vanishes and −B stays
///   tau_q = tau_p/rho² + 2 p tau_rho/rho³ + 3 u p/rho²
///   tau_a,c = (√n + 8) u [Σ |t|(1 + κ) + pose] + √Σ (m tau_q,j G x_c)² + 2 tau_q,i |Σ m G x_c +
///             Σ rho0 V_b G x_c| + Σ (tau_rho,i/rho_i + tau_rho,j/rho_j)|t_visc| + Σ tau(V_b)/V_b |t|
///             + 3 u (|g| + |a|)
///
/// A pair that the oracle has at H or beyond and fp32 may have inside adds its term at H − 8 u X, the
/// nearest place that fp32 may find, to each of them.
///
/// With `given`, density and pressure are inputs, exact to both sides: their tolerances vanish from
/// what follows.
OracleAnswer answer(const Scene& scene, const Walls& walls, const WallAnswer& volumes,
                    const ParticleState& state, const StageInputs* given = nullptr);
OracleAnswer answer(const Scene& scene, const Walls& walls, const ParticleState& state);

/// The oracle's own source in sequential fp32 on the same inputs: what plain single precision costs.
Fields float_fields(const Scene& scene, const Walls& walls, const WallAnswer& volumes,
                    const ParticleState& state, const StageInputs* given = nullptr);

}  // namespace decant
