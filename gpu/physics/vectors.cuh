/// \file
/// Arithmetic on vectors, and roots and quotients in fp32.
#pragma once

#include "gpu/core/particle_arrays.cuh"

namespace decant::gpu {
namespace {

DECANT_DEVICE Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
DECANT_DEVICE Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
DECANT_DEVICE Float3 operator*(float s, Float3 a) { return {s * a.x, s * a.y, s * a.z}; }
DECANT_DEVICE float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
/// |a|², rounded the same wherever it stands: a compiler may fuse the products of two copies of a sum differently.
DECANT_DEVICE float square_of(Float3 a) {
#ifdef __CUDACC__
  return __fmaf_rn(a.z, a.z, __fmaf_rn(a.y, a.y, __fmul_rn(a.x, a.x)));
#else
  return dot(a, a);
#endif
}
DECANT_DEVICE Float3 cross(Float3 a, Float3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
DECANT_DEVICE Float3 xyz(float4 v) { return {v.x, v.y, v.z}; }
/// A position with |x|².
DECANT_DEVICE float4 with_square(Float3 x) { return make_float4(x.x, x.y, x.z, dot(x, x)); }

DECANT_DEVICE bool is_finite(Float3 v) {
  return fabsf(v.x) <= 3.0e38f && fabsf(v.y) <= 3.0e38f && fabsf(v.z) <= 3.0e38f;
}

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

/// What fp32 may be off a distance that is computed at x.
DECANT_DEVICE float rounding_of(Float3 x) { return 0x1p-19f * (fabsf(x.x) + fabsf(x.y) + fabsf(x.z)); }

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

}  // namespace
}  // namespace decant::gpu
