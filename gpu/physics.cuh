/// \file
/// Kernel functions and pair terms in fp32, written apart from the oracle's. Legend: r distance,
/// q = r/h, W density kernel, G = −W'/r (mueller2003: spiky), L viscosity kernel; sources as in the
/// project's physics: Monaghan 1992, Wendland 1995, Müller et al. 2003, Morris et al. 1997,
/// Becker & Teschner 2007, Akinci et al. 2012.
#pragma once

#include "gpu/device_scene.hpp"
#include "gpu/exec.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

DECANT_DEVICE Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
DECANT_DEVICE Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
DECANT_DEVICE Float3 operator*(float s, Float3 a) { return {s * a.x, s * a.y, s * a.z}; }
DECANT_DEVICE float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
DECANT_DEVICE Float3 cross(Float3 a, Float3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
DECANT_DEVICE Float3 xyz(float4 v) { return {v.x, v.y, v.z}; }
/// A point as queries read it: x, y, z and |x|².
DECANT_DEVICE float4 point_at(Float3 x) { return make_float4(x.x, x.y, x.z, dot(x, x)); }

/// r and 1/r from r²; no branch, no call. At r = 0 the inverse is huge and finite.
struct Radius {
  float r, inverse;
};
DECANT_DEVICE Radius radius(float r2) {
#ifdef __CUDACC__
  const float y = rsqrtf(fmaxf(r2, 1e-30f)), r = r2 * y;
  // One step of Newton's: the approximation's two last bits would be the largest error of a term.
  return {fmaf(fmaf(-r, r, r2), 0.5f * y, r), y};
#else
  const float r = sqrtf(r2);
  return {r, 1.0f / (r > 1e-15f ? r : 1e-15f)};
#endif
}
DECANT_DEVICE float quotient(float a, float b) {
#ifdef __CUDACC__
  return __fdividef(a, b);  // b is far from the ends of fp32's range
#else
  return a / b;
#endif
}
DECANT_DEVICE float positive(float s) { return s > 0.0f ? s : 0.0f; }

/// The kernels of one family: W(r), 1/m³, G(r) and, from G at the same distance, L(r), 1/m⁵; all are 0
/// from H on. The family is known at compile time: branches between pairs would keep their arithmetic
/// from overlapping.
template <KernelId>
struct Kernel;

template <>
struct Kernel<KernelId::cubic_spline> {
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
  DECANT_DEVICE static float l(const Constants& c, Radius, float r2, float g) {
    return quotient(2.0f * r2 * g, r2 + c.h2_soft);
  }
};

template <>
struct Kernel<KernelId::wendland_c2> {
  DECANT_DEVICE static float w(const Constants& c, Radius d) {
    const float q = d.r * c.inverse_h;
    const float s = positive(1.0f - 0.5f * q), s2 = s * s;
    return c.w_norm * s2 * s2 * (1.0f + 2.0f * q);
  }
  DECANT_DEVICE static float g(const Constants& c, Radius d) {
    const float s = positive(1.0f - 0.5f * (d.r * c.inverse_h));
    return c.g_norm * s * s * s;
  }
  DECANT_DEVICE static float l(const Constants& c, Radius, float r2, float g) {
    return quotient(2.0f * r2 * g, r2 + c.h2_soft);
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
  DECANT_DEVICE static float l(const Constants& c, Radius d, float, float) {
    return c.g_norm * positive(c.H - d.r);
  }
};

/// call(Kernel) for the scene's family.
template <class Call>
DECANT_DEVICE void with_kernel(const Constants& c, Call&& call) {
  if (c.kernel == KernelId::cubic_spline)
    call(Kernel<KernelId::cubic_spline>());
  else if (c.kernel == KernelId::wendland_c2)
    call(Kernel<KernelId::wendland_c2>());
  else
    call(Kernel<KernelId::mueller2003>());
}

/// p(rho), Pa.
DECANT_DEVICE float pressure_at(const Constants& c, float density) {
  const float s = density * c.inverse_rest_density;
  float power = s;
  if (c.eos_exponent == 7) {
    const float s2 = s * s;
    power = s2 * s2 * s2 * s;
  }
  const float p = c.stiffness * (power - 1.0f);
  return c.allow_tension || !(p < 0.0f) ? p : 0.0f;
}

/// What fp32 may be off a distance that is computed at x.
DECANT_DEVICE float rounding_of(Float3 x) {
  return 0x1p-19f * (fabsf(x.x) + fabsf(x.y) + fabsf(x.z));
}

/// d by the nearest image; `periodic` is known at compile time so that free scenes pay nothing.
template <bool periodic>
DECANT_DEVICE Float3 nearest_image(const Constants& c, Float3 d) {
  if constexpr (periodic) {
    d.x -= c.period[0] * rintf(d.x * c.inverse_period[0]);
    d.y -= c.period[1] * rintf(d.y * c.inverse_period[1]);
    d.z -= c.period[2] * rintf(d.z * c.inverse_period[2]);
  }
  return d;
}

}  // namespace decant::gpu::DECANT_EXECUTOR
