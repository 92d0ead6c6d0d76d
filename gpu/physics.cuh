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

/// W(r), 1/m³, for r < H.
DECANT_DEVICE float kernel_w(const Constants& c, float r) {
  const float q = r * c.inverse_h;
  if (c.kernel == KernelId::cubic_spline) {
    if (q < 1.0f) return c.w_norm * (1.0f - q * q * (1.5f - 0.75f * q));
    const float s = 2.0f - q;
    return c.w_norm * 0.25f * (s * s * s);
  }
  if (c.kernel == KernelId::wendland_c2) {
    const float s = 1.0f - 0.5f * q, s2 = s * s;
    return c.w_norm * s2 * s2 * (1.0f + 2.0f * q);
  }
  const float s = 1.0f - 0.25f * q * q;  // 1 − (r/H)²
  return c.w_norm * s * s * s;
}

/// G(r), 1/m⁵, for r < H; 0 at r = 0 where it is singular.
DECANT_DEVICE float kernel_g(const Constants& c, float r) {
  const float q = r * c.inverse_h;
  if (c.kernel == KernelId::cubic_spline) {
    if (q < 1.0f) return c.g_norm * (3.0f - 2.25f * q);
    const float s = 2.0f - q;
    return c.g_norm * 0.75f * s * s / q;
  }
  if (c.kernel == KernelId::wendland_c2) {
    const float s = 1.0f - 0.5f * q;
    return c.g_norm * s * s * s;
  }
  const float s = c.H - r;
  return r > 0.0f ? c.g_norm * s * s / r : 0.0f;
}

/// L(r), 1/m⁵, from G at the same distance.
DECANT_DEVICE float kernel_l(const Constants& c, float r, float g) {
  if (c.kernel == KernelId::mueller2003) return c.g_norm * (c.H - r);
  return 2.0f * r * r * g / (r * r + c.h2_soft);
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
