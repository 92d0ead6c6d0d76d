/// \file
/// How many roundings each operation is charged with, in units of u, and what an acceleration's tolerance is
/// put together from. tolerances.md counts them.
#pragma once

#include "oracle/solution/sum_bound.hpp"
#include "oracle/solution/tolerance.hpp"
#include "reference/scene.hpp"

#include <Eigen/Dense>

#include <cmath>

namespace decant {

/// Unit roundoff of what is judged and of the oracle together.
inline constexpr double both_roundoffs = unit_roundoff + reference_roundoff;

/// Roundings, in units of u, of constants that a port may form in fp32: all terms have them in common.
struct CommonRoundings {
  double W, G;  // the kernels' norms

  explicit CommonRoundings(KernelFamily family)
      : W(family == KernelFamily::mueller2003 ? 11 : 5), G(family == KernelFamily::mueller2003 ? 8 : 7) {}
};
inline constexpr double of_mass = 4;
// Inside a term: beside a distance's, and a distance's, by the term's condition.
inline constexpr double of_density_term = 8, of_pressure_term = 12, of_viscous_term = 16;
inline constexpr double of_wall_factors = 2;  // rho0 V_b or mu_w V_b in place of m
inline constexpr double of_distance = 6.5, of_distance_and_H = 7.5;

/// A product of factors that is smaller may pass through numbers below smallest_normal, in some order of them: 2²⁰ is
/// left for constants, and for factors that are split further.
inline constexpr double may_underflow = 0x1p20 * smallest_normal;
/// What a factor makes of the smallest product that it is part of.
inline double least(double factor) { return factor < 1 ? factor : 1; }

/// What the accelerations' tolerances are made of, for one particle, by component.
struct ForceBounds {
  SumBound sum[3];
  Vec3 condition = Vec3::Zero();  // Σ |t|(1 + κ)
  Vec3 inside = Vec3::Zero();     // Σ |t|(a + bκ), units of u
  Vec3 total = Vec3::Zero();      // Σ t
  Vec3 pose = Vec3::Zero();       // Σ |∂t/∂x_b| e_b
  Vec3 inputs = Vec3::Zero();     // from tau(V_b) and, for viscosity, tau_rho; and underflow
  Vec3 squares = Vec3::Zero();    // Σ (m tau_q,j G x_c)²
  Vec3 gradient = Vec3::Zero();   // Σ m G x_c or Σ rho0 V_b G x_c, signed

  void add(const Vec3& term) {
    for (int c = 0; c < 3; ++c) sum[c].add(term[c]);
    total += term;
  }
  /// A term that may pass through a product too small for fp32 may be lost as a whole. What it is made from may be, too,
  /// and what sums come to.
  /// \param factors  product of least(…) of all its factors but x; \param x  x_ij or v_j − v_i, of components that differ;
  /// \param by_x     what the term is by x
  void underflow(const Vec3& term, double factors, const Vec3& x, double by_x) {
    for (int c = 0; c < 3; ++c) {
      if (term[c] == 0) continue;  // so it is in fp32
      if (factors * least(std::abs(x[c])) < may_underflow) inputs[c] += std::abs(term[c]);
      inputs[c] += 2 * smallest_normal * (1 + by_x);
    }
  }
  /// What all terms of the part have in common.
  void close(double roundings) { inside += roundings * total.cwiseAbs(); }
  void clear() {
    for (SumBound& of_component : sum) of_component.clear();
    condition = inside = total = pose = inputs = squares = gradient = Vec3::Zero();
  }
  Vec3 tolerance(double tau_q, CellCounter& cells) const {
    Vec3 rounding;
    for (int c = 0; c < 3; ++c) rounding[c] = sum[c].error(both_roundoffs, both_roundoffs * inside[c], cells);
    return rounding + pose + inputs + squares.cwiseSqrt() + 2 * tau_q * gradient.cwiseAbs();
  }
  ForceBounds& operator+=(const ForceBounds& o) {
    for (int c = 0; c < 3; ++c) sum[c].add(o.sum[c]);
    condition += o.condition;
    inside += o.inside;
    total += o.total;
    pose += o.pose;
    inputs += o.inputs;
    squares += o.squares;
    gradient += o.gradient;
    return *this;
  }
};

}  // namespace decant
