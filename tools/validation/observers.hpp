/// \file
/// The observers of all cases, one maker each; what they compare with is said at the class.
#pragma once

#include "tools/validation/curves.hpp"
#include "tools/validation/validation.hpp"

#include <memory>

namespace decant::validate {

std::unique_ptr<Observer> observe_free_fall(const Inputs& inputs);
std::unique_ptr<Observer> observe_still_water(const Inputs& inputs);
std::unique_ptr<Observer> observe_couette(const Inputs& inputs);
std::unique_ptr<Observer> observe_poiseuille(const Inputs& inputs);
std::unique_ptr<Observer> observe_drop(const Inputs& inputs);
std::unique_ptr<Observer> observe_dam_front(const Inputs& inputs);
std::unique_ptr<Observer> observe_dam_wall(const Inputs& inputs);
std::unique_ptr<Observer> observe_dam_obstacle(const Inputs& inputs);
std::unique_ptr<Observer> observe_slit(const Inputs& inputs);
std::unique_ptr<Observer> observe_slow_pour(const Inputs& inputs);

/// Velocity of plane Couette flow from rest at a height z above the plate at rest, m/s:
///   u = V z/L + Σ_n (2V/nπ)(−1)ⁿ sin(nπz/L) e^{−n²π²νt/L²}
/// Source: Morris, Fox & Zhu, J. Comput. Phys. 136 (1997), eq. 28.
/// \param V  m/s, of the plate at z = L; \param nu  m²/s; \param L  m; \param t  s
double couette_velocity(double V, double nu, double L, double z, double t);

/// Velocity of plane Poiseuille flow from rest, m/s:
///   u = F z(L − z)/2ν − Σ_n 4FL²/(νπ³(2n+1)³) sin((2n+1)πz/L) e^{−(2n+1)²π²νt/L²}
/// Source: Morris, Fox & Zhu 1997, eq. 24.
/// \param F  m/s², body force
double poiseuille_velocity(double F, double nu, double L, double z, double t);

/// Long semi-axis b of the drop that is stretched without gravity, in first radii; the short one is 1/b:
///   a' = −aA, A' = A²(a⁴ − 1)/(a⁴ + 1), b = 1/a. Source: Monaghan, J. Comput. Phys. 110 (1994), eq. 5.1.
/// \param A  1/s, at the start; \param t  s
double drop_axis(double A, double t);

/// What a cup that leans by `angle` still holds once nothing flows any more, m³:
///   tanθ <= Hc/2R: V = πR²(Hc − R tanθ), else with c = Hc/tanθ, φ = acos(1 − c/R), s = R sinφ:
///   V = Hc/(3c) [s(3R² − s²) + 3R²(c − R)φ]
/// Exact: the water below the horizontal plane through a sharp lip.
/// \param R  m, inner radius; \param Hc  m, inner height; \param angle  rad
double cup_residual(double R, double Hc, double angle);

}  // namespace decant::validate
