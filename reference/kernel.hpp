/// \file
/// The three kernel families. A family is three radial functions: W(r) for density, G(r) for
/// pressure (∇_i W_ij = −G x_ij), L(r) >= 0 for viscosity. Support ends at H; h = H/2, q = r/h.
/// Callers ask only for r < H (neighbors.hpp decides that, once).
#pragma once

#include "reference/scene.hpp"

#include <cmath>
#include <numbers>

namespace decant {

template <class Real>
class Kernel {
 public:
  /// \param support_radius  H, m
  Kernel(KernelFamily family, double support_radius)
      : family_(family), H_(static_cast<Real>(support_radius)), h_(static_cast<Real>(0.5 * support_radius)) {
    const double pi = std::numbers::pi, H = support_radius, h = 0.5 * H;
    switch (family) {
      case KernelFamily::cubic_spline:
        w_ = static_cast<Real>(1 / (pi * h * h * h));
        g_ = static_cast<Real>(1 / (pi * std::pow(h, 5)));
        break;
      case KernelFamily::wendland_c2:
        w_ = static_cast<Real>(21 / (16 * pi * h * h * h));
        g_ = static_cast<Real>(105 / (16 * pi * std::pow(h, 5)));
        break;
      case KernelFamily::mueller2003:
        w_ = static_cast<Real>(315 / (64 * pi * std::pow(H, 9)));
        g_ = static_cast<Real>(45 / (pi * std::pow(H, 6)));
        break;
    }
  }

  /// W(r), 1/m³. Sources: cubic spline, Monaghan, Annu. Rev. Astron. Astrophys. 30 (1992), §2.1;
  /// C2, Wendland, Adv. Comput. Math. 4 (1995), table 1; poly6, Müller et al., SCA 2003, eq. 20.
  Real W(Real r) const {
    const Real q = r / h_;
    switch (family_) {
      case KernelFamily::cubic_spline:
        if (q < 1) return w_ * (1 - Real(1.5) * q * q + Real(0.75) * q * q * q);
        return w_ * Real(0.25) * (2 - q) * (2 - q) * (2 - q);
      case KernelFamily::wendland_c2: {
        const Real s = 1 - q / 2;
        return w_ * s * s * s * s * (2 * q + 1);
      }
      case KernelFamily::mueller2003:
        break;
    }
    const Real s = H_ * H_ - r * r;
    return w_ * s * s * s;
  }

  /// G(r), 1/m⁵: −W'/r, and for mueller2003 the spiky kernel's (H − r)²·45/(πH⁶)/r (Müller et al.
  /// 2003, eq. 21), which is 0 here at r = 0 because x_ij is.
  Real G(Real r) const {
    const Real q = r / h_;
    switch (family_) {
      case KernelFamily::cubic_spline:
        if (q < 1) return g_ * (3 - Real(2.25) * q);
        return g_ * Real(0.75) * (2 - q) * (2 - q) / q;
      case KernelFamily::wendland_c2: {
        const Real s = 1 - q / 2;
        return g_ * s * s * s;
      }
      case KernelFamily::mueller2003:
        break;
    }
    return r > 0 ? g_ * (H_ - r) * (H_ - r) / r : Real(0);
  }

  /// L(r), 1/m⁵: 2r²G/(r² + 0.01h²) (Morris et al., J. Comput. Phys. 136 (1997), eq. 22), and for
  /// mueller2003 the Laplacian 45/(πH⁶)·(H − r) (Müller et al. 2003, eq. 22).
  Real L(Real r) const { return L(r, G(r)); }
  /// The same where G(r) is known already.
  Real L(Real r, Real G) const {
    if (family_ == KernelFamily::mueller2003) return g_ * (H_ - r);
    return 2 * r * r * G / (r * r + Real(0.01) * h_ * h_);
  }

  /// The constant that G and L are multiples of, 1/m⁵; mueller2003: 1/m⁶.
  Real norm_G() const { return g_; }

  /// |W'(r)|, 1/m⁴.
  Real slope_W(Real r) const {
    if (family_ != KernelFamily::mueller2003) return r * G(r);
    const Real s = H_ * H_ - r * r;
    return 6 * w_ * r * s * s;
  }

  /// |G'(r)|, 1/m⁶.
  Real slope_G(Real r) const {
    const Real q = r / h_;
    switch (family_) {
      case KernelFamily::cubic_spline:
        if (q < 1) return g_ / h_ * Real(2.25);
        return g_ / h_ * Real(0.75) * (4 - q * q) / (q * q);
      case KernelFamily::wendland_c2:
        return g_ / h_ * Real(1.5) * (1 - q / 2) * (1 - q / 2);
      case KernelFamily::mueller2003:
        break;
    }
    return r > 0 ? g_ * ((H_ - r) * (H_ - r) / (r * r) + 2 * (H_ - r) / r) : Real(0);
  }

  /// An upper bound of |L'(r)|, 1/m⁶.
  Real slope_L(Real r) const {
    if (family_ == KernelFamily::mueller2003) return g_;
    const Real soft = Real(0.01) * h_ * h_, s = r * r + soft;
    return 2 * (r * r * slope_G(r) * s + 2 * r * G(r) * soft) / (s * s);
  }

 private:
  KernelFamily family_;
  Real H_, h_;
  Real w_ = 0, g_ = 0;  // normalisation of W and of G
};

}  // namespace decant
