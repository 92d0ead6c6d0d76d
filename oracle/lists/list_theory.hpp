/// \file
/// What theory says a stale list will miss, from one state alone, before anything is run: pairs that
/// stand near H approach each other at speeds that the state tells, and what has come inside by a later
/// time without having been listed is missed. The same estimate as for buffered lists of molecular
/// dynamics, with the kernel's edge in place of a potential's, and with densities counted where the
/// fluid is, so that empty space does not dilute them.
///
/// Legend: H support radius, s skin over H, u how far a pair has come nearer over H, x depth (H − r)/H
/// of a missed pair, ν pairs a particle and unit of r/H near H.
///
///   missed pairs a particle = ν ⟨(u − s)⁺⟩;  mean square of a deficit = ν ⟨∫₀^(u−s) f(x)² dx⟩,
///   f = m W for density, the pair's pressure and viscous terms for acceleration, and beside them what
///   the density's deficit hands on through the equation of state.
///
/// Sources: Páll & Hess, Comput. Phys. Commun. 184 (2013), §3, for the estimate; Verlet, Phys. Rev. 159
/// (1967), for lists. What it leaves out: that speeds change meanwhile, and the order of a lattice.
#pragma once

#include "oracle/lists/stale_list.hpp"

#include <array>
#include <vector>

namespace decant {

/// A pair whose distance is near H.
struct NearPair {
  double approach = 0;   // 1/s, speed at which it comes nearer, over H; negative: it parts
  double mass = 0;       // kg, m or rho0 V_b: times W its share of the density
  double pressure = 0;   // times r G its pressure term, m/s²
  double viscous = 0;    // times L its viscous term, m/s²
  double cosine = 0;     // between the two terms
  double handed_on = 0;  // times W what its share of the density, missing, does to accelerations by way of
                         // pressure: of the particle and of its neighbors, together, m/s²
};

/// The pairs near H of one state, and what their deficits are compared with.
struct PairsNearEdge {
  std::vector<NearPair> pairs;  // fluid with fluid in both directions, and fluid with wall
  double particles = 0;
  double neighbors = 0;                              // within H, a particle; walls included
  double density_rms = 0;                            // kg/m³
  double acceleration_rms = 0;                       // m/s², without gravity
  double fastest = 0, second = 0, wall_fastest = 0;  // m/s

  /// Half the thickness of the shell around H, over H.
  static constexpr double width = 0.1;
};

/// \param now  a state with its true neighbors and fields; \param volumes  M, m³
PairsNearEdge pairs_near_edge(const Scene& scene, const Eigen::VectorXd& volumes, const Instant& now);

/// A list's errors, mean over particles.
struct ExpectedDrift {
  double missed_share = 0;      // of the pairs within H
  double density_rms = 0;       // over the field's
  double acceleration_rms = 0;  // over the field's
};

/// What a list with that skin misses `seconds` after its build.
ExpectedDrift expected_drift(const Scene& scene, const PairsNearEdge& near, double seconds, double skin);

/// The smallest skin (share of H, at most 1) with which the acceleration stays within `tolerance`
/// (relative RMS) until `seconds` after the build; 1 where none does.
double skin_for(const Scene& scene, const PairsNearEdge& near, double seconds, double tolerance);

/// Longest interval, substeps, that no pair can be missed in at the state's speeds, counted like
/// intervals: a list used for N substeps is N − 1 old at its last. At most `longest`.
/// \param relative  false: by the fastest particles, as the displacement bound does; true: by the pair
/// near H that approaches fastest
int expected_safe_interval(const Scene& scene, const PairsNearEdge& near, double skin, bool relative, int longest);

/// Powers of the relative displacement with which missed pairs, mean density deficit and mean
/// acceleration deficit of a list without skin grow: W ~ x^k at the edge gives k + 1, the least power
/// among the forces' kernels gives that of the acceleration.
std::array<double, 3> edge_powers(const Scene& scene);

}  // namespace decant
