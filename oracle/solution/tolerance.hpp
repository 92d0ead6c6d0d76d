/// \file
/// How far a correct fp32 backend may be from the oracle, particle by particle, derived from the sums
/// it has to form and never tuned. Every formula, and which forms of an operation are legal, stands in
/// tolerances.md, so that each tolerance can be recomputed from the text alone.
///
/// Legend: u = 2⁻²⁴ + 2⁻⁵³, a port's unit roundoff and the oracle's; a sum of n terms, each with a few
/// roundings inside, differs from the exact one by what its additions lose (sum_bound.hpp) and by
/// u Σ|t|(a + bκ), κ the term's own condition: a radial function f(r) of a rounded distance has
/// κ = r|f'|/f (Higham, Accuracy and Stability of Numerical Algorithms, §3–4), and a, b count
/// its roundings.
#pragma once

#include "oracle/solution/fixture.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <memory>
#include <vector>

namespace decant {

inline constexpr double unit_roundoff = 0x1p-24;
/// Of fp32: whatever is smaller a port may take for 0, or round to few digits.
inline constexpr double smallest_normal = 0x1p-126;

/// The oracle's fields with the tolerance of each value, laid out alike (integers: 0).
struct ReferenceSolution {
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
struct WallSolution {
  Eigen::VectorXd volume, tolerance, fp32_volume;
};
WallSolution wall_solution(const Scene& scene, const Walls& walls);

/// Fields, condition sums and tolerances at one state. S(·) is the bound of a sum in any order with what
/// happens inside its terms (sum_bound.hpp), e_b the error of a wall particle's place (pose_error.hpp), ê its
/// part along x_ib, q = p/rho², c a component; a, b, k count roundings (tolerances.md).
///
///   tau(V_b) = V_b² S(W) + 2 u V_b
///   tau_rho = S(m W, rho0 V_b W) + Σ rho0 V_b |W'| ê_b + Σ rho0 tau(V_b) W
///   tau_p = c0² (rho/rho0)^(gamma−1) tau_rho + u [(2 gamma + 6) B (rho/rho0)^gamma + 6 |p|], p unclamped;
///           3 gamma where rho0 is no fp32 number; 0 where p is certainly clamped
///   tau_q = tau_p/rho² + 2 |p| tau_rho/rho³ + 4 u |p|/rho²
///   tau_a,c = S(t_c, g_c) + Σ |∂t/∂x_b| e_b + √Σ (m tau_q,j G x_c)² + 2 tau_q,i |Σ m G x_c +
///             Σ rho0 V_b G x_c| + Σ (tau_rho,i/rho_i + tau_rho,j/rho_j)|t_visc| + Σ tau(V_b)/V_b |t|
///
/// S charges, in units of u: inside a density's term a = 8 and b = 6.5 by κ, a pressure term's 12 and 7.5, a
/// viscous one's 16 and 7.5, 2 more of wall terms; in common of a sum, times its own size, 5 (mueller2003: 11)
/// for W's norm, 7 (8) for G's, 4 for m, 5 for H in accelerations, and |Σ t (κ − 3)| for H in densities.
///
/// A pair that fp32 may find on the other side of H adds its term at the nearest place that fp32 may find,
/// to each of them. What underflow may take from accelerations stands in tolerances.md. With `given`, density and pressure are inputs, exact to both sides: their tolerances
/// vanish from what follows; density alone is that of the equation of state.
ReferenceSolution reference_solution(const Scene& scene, const Walls& walls, const WallSolution& volumes,
                                     const ParticleState& state, const StageInputs* given = nullptr);
ReferenceSolution reference_solution(const Scene& scene, const Walls& walls, const ParticleState& state);

/// The reference at one state, whose neighbors and places of walls are found once. What it is made from outlives it.
class ReferenceAt {
 public:
  ReferenceAt(const Scene& scene, const Walls& walls, const WallSolution& volumes, const ParticleState& state);
  ~ReferenceAt();
  ReferenceAt(const ReferenceAt&) = delete;
  ReferenceAt& operator=(const ReferenceAt&) = delete;

  /// As reference_solution has it.
  ReferenceSolution solution(const StageInputs* given = nullptr);
  /// The oracle's own source in sequential fp32 on the same inputs: what plain single precision costs.
  Fields fp32_fields(const StageInputs* given = nullptr) const;

 private:
  class Bounds;
  std::unique_ptr<Bounds> bounds_;
};

}  // namespace decant
