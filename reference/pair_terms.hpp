/// \file
/// What one neighbor contributes to one particle. Legend: i gathers, j is a fluid neighbor, b a wall
/// neighbor, x_ij = x_i − x_j, m mass, rho0 rest density, V_b boundary volume, mu viscosity,
/// W, G, L the kernel's values at |x_ij| (kernel.hpp).
#pragma once

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace decant {

template <class Real>
using Vector3 = Eigen::Matrix<Real, 3, 1>;

/// p(rho) = B((rho/rho0)^gamma − 1), Pa; without tension max(p, 0).
/// Source: Becker & Teschner, SCA 2007, eq. 7. \param B  Pa; densities kg/m³
template <class Real>
Real pressure_of(Real density, Real rest_density, Real B, Real gamma, bool allow_tension) {
  const Real p = B * (std::pow(density / rest_density, gamma) - 1);
  return allow_tension ? p : std::max(p, Real(0));
}

/// m W, kg/m³. Source: Monaghan 1992, eq. 2.4.
template <class Real>
Real density_term(Real mass, Real W) {
  return mass * W;
}

/// rho0 V_b W, kg/m³. Source: Akinci et al., ACM TOG 31(4) 2012, eq. 6.
template <class Real>
Real wall_density_term(Real rest_density, Real boundary_volume, Real W) {
  return rest_density * boundary_volume * W;
}

/// m (q_i + q_j) G x_ij, m/s², q = p/rho² in Pa·m⁶/kg². Antisymmetric for equal masses.
/// Source: Monaghan 1992, eq. 3.3.
template <class Real>
Vector3<Real> pressure_term(Real mass, Real q_i, Real q_j, Real G, const Vector3<Real>& x_ij) {
  return mass * (q_i + q_j) * G * x_ij;
}

/// rho0 V_b q_i G x_ib, m/s². Source: Akinci et al. 2012, eq. 9.
template <class Real>
Vector3<Real> wall_pressure_term(Real rest_density, Real boundary_volume, Real q_i, Real G, const Vector3<Real>& x_ib) {
  return rest_density * boundary_volume * q_i * G * x_ib;
}

/// (mu/rho_i)(m/rho_j)(v_j − v_i) L, m/s². Antisymmetric for equal masses up to rounding.
/// Sources: Müller et al. 2003, eq. 14; Morris et al. 1997, eq. 22.
template <class Real>
Vector3<Real> viscous_term(Real viscosity, Real mass, Real density_i, Real density_j, const Vector3<Real>& v_i,
                           const Vector3<Real>& v_j, Real L) {
  return viscosity / density_i * (mass / density_j) * L * (v_j - v_i);
}

/// (mu_w/rho_i) V_b (v_b − v_i) L, m/s². Source: the viscous term above with m/rho_j → V_b.
template <class Real>
Vector3<Real> wall_viscous_term(Real wall_viscosity, Real boundary_volume, Real density_i, const Vector3<Real>& v_i,
                                const Vector3<Real>& v_b, Real L) {
  return wall_viscosity / density_i * boundary_volume * L * (v_b - v_i);
}

}  // namespace decant
