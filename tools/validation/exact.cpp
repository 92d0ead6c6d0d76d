/// \file
/// Solutions in closed form, or of one ordinary differential equation.
#include "tools/validation/observers.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace decant::validate {
namespace {

using std::numbers::pi;

}  // namespace

double couette_velocity(double V, double nu, double L, double z, double t) {
  double u = V * z / L;
  for (int n = 1; n <= 200; ++n)
    u += 2 * V / (n * pi) * (n % 2 ? -1 : 1) * std::sin(n * pi * z / L) * std::exp(-n * n * pi * pi * nu * t / (L * L));
  return u;
}

double poiseuille_velocity(double F, double nu, double L, double z, double t) {
  double u = F * z * (L - z) / (2 * nu);
  for (int n = 0; n < 100; ++n) {
    const double k = 2 * n + 1;
    u -= 4 * F * L * L / (nu * pi * pi * pi * k * k * k) * std::sin(k * pi * z / L) *
         std::exp(-k * k * pi * pi * nu * t / (L * L));
  }
  return u;
}

double drop_axis(double A, double t) {
  constexpr int steps = 2000;
  const double dt = t / steps;
  double a = 1;
  const auto rate = [](double axis, double stretching) {
    const double a4 = axis * axis * axis * axis;
    return std::array{-axis * stretching, stretching * stretching * (a4 - 1) / (a4 + 1)};
  };
  for (int k = 0; k < steps; ++k) {
    const auto k1 = rate(a, A), k2 = rate(a + 0.5 * dt * k1[0], A + 0.5 * dt * k1[1]),
               k3 = rate(a + 0.5 * dt * k2[0], A + 0.5 * dt * k2[1]), k4 = rate(a + dt * k3[0], A + dt * k3[1]);
    a += dt / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]);
    A += dt / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]);
  }
  return 1 / a;
}

double cup_residual(double R, double Hc, double angle) {
  const double slope = std::tan(angle);
  if (slope <= Hc / (2 * R)) return pi * R * R * (Hc - R * slope);
  const double c = Hc / slope, phi = std::acos(1 - c / R), s = R * std::sin(phi);
  return Hc / (3 * c) * (s * (3 * R * R - s * s) + 3 * R * R * (c - R) * phi);
}

}  // namespace decant::validate
