/// \file
/// SPH kernel functions in fp32, written apart from the oracle's. r distance, q = r/h, W density kernel,
/// G = −W'/r (mueller2003: spiky), L viscosity kernel. Monaghan 1992; Wendland 1995; Müller et al. 2003;
/// Morris et al. 1997.
#pragma once

#include "gpu/physics/vectors.cuh"

namespace decant::gpu {
namespace {

DECANT_DEVICE float positive(float s) { return s > 0.0f ? s : 0.0f; }

/// The kernel functions of one family: W(r), 1/m³, G(r) and, from G at the same distance, L(r), 1/m⁵; all are 0
/// from H on. The family is known at compile time: branches between pairs would keep their arithmetic
/// from overlapping.
template <KernelId>
struct Kernel;

/// L from G, of families without a viscosity kernel of their own.
struct MorrisViscosity {
  DECANT_DEVICE static float l(const Constants& c, Radius, float r2, float g) {
    return quotient(2.0f * r2 * g, r2 + c.h2_soft);
  }
};

template <>
struct Kernel<KernelId::cubic_spline> : MorrisViscosity {
  DECANT_DEVICE static float w(const Constants& c, Radius d) {
    const float q = d.r * c.inverse_h;
    const float s = positive(2.0f - q), outer = 0.25f * (s * s * s);
    return c.w_norm * (q < 1.0f ? 1.0f - q * q * (1.5f - 0.75f * q) : outer);
  }
  DECANT_DEVICE static float g(const Constants& c, Radius d) {
    const float q = d.r * c.inverse_h;
    const float s = positive(2.0f - q);
    const float far = c.g_far * d.inverse * (s * s);
    return q < 1.0f ? c.g_near[0] - c.g_near[1] * q : far;
  }
};

template <>
struct Kernel<KernelId::wendland_c2> : MorrisViscosity {
  DECANT_DEVICE static float w(const Constants& c, Radius d) {
    const float q = d.r * c.inverse_h;
    const float s = positive(1.0f - 0.5f * q), s2 = s * s;
    return c.w_norm * s2 * s2 * (1.0f + 2.0f * q);
  }
  DECANT_DEVICE static float g(const Constants& c, Radius d) {
    const float s = positive(1.0f - 0.5f * (d.r * c.inverse_h));
    return c.g_norm * s * s * s;
  }
};

template <>
struct Kernel<KernelId::mueller2003> {
  DECANT_DEVICE static float w(const Constants& c, Radius d) {
    const float q = d.r * c.inverse_h;
    const float s = positive(1.0f - 0.25f * q * q);  // 1 − (r/H)²
    return c.w_norm * s * s * s;
  }
  DECANT_DEVICE static float g(const Constants& c, Radius d) {
    const float s = positive(c.H - d.r);
    return c.g_norm * s * s * d.inverse;
  }
  DECANT_DEVICE static float l(const Constants& c, Radius d, float, float) { return c.g_norm * positive(c.H - d.r); }
};

/// call(Kernel) for the scene's family.
template <class Call>
DECANT_DEVICE void with_kernel(const Constants& c, Call&& call) {
  if (c.kernel == KernelId::cubic_spline) call(Kernel<KernelId::cubic_spline>());
  else if (c.kernel == KernelId::wendland_c2) call(Kernel<KernelId::wendland_c2>());
  else call(Kernel<KernelId::mueller2003>());
}

}  // namespace
}  // namespace decant::gpu
