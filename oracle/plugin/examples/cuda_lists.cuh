// Kernels of cuda_lists.cu: one thread per particle.
#pragma once

#include "oracle/plugin.h"

struct Constants {
  int kernel;
  float H, h, m, rho0, mu, mu_w, period[3];
};

struct Sums {  // no padding, which nobody would write
  long long fluid_sum, wall_sum;
  float density;
  int fluid_count, wall_count, unused;
  float3 pressure, viscous, wall_pressure, wall_viscous;
};

__device__ float3 minus(const Constants& c, float3 a, float3 b) {  // by the nearest image
  float d[3] = {a.x - b.x, a.y - b.y, a.z - b.z};
  for (int k = 0; k < 3; ++k)
    if (c.period[k] > 0) d[k] -= c.period[k] * rintf(d[k] / c.period[k]);
  return make_float3(d[0], d[1], d[2]);
}
__device__ float squared(float3 d) { return d.x * d.x + d.y * d.y + d.z * d.z; }
__device__ void add(float3& to, float f, float3 d) { to.x += f * d.x, to.y += f * d.y, to.z += f * d.z; }
__device__ float3 between(float3 a, float3 b) { return make_float3(b.x - a.x, b.y - a.y, b.z - a.z); }

__device__ float W(const Constants& c, float r) {
  const float q = r / c.h, u = fmaxf(0, 2 - q), unit = 1 / (3.14159265f * c.h * c.h * c.h);
  if (c.kernel == DECANT_MUELLER_2003) return 315.0f / 512 * unit * powf(fmaxf(0, 1 - q * q / 4), 3);
  if (c.kernel == DECANT_WENDLAND_C2) return 21.0f / 256 * unit * u * u * u * u * (2 * q + 1);
  return unit * (q < 1 ? 1 - q * q * (1.5f - 0.75f * q) : 0.25f * u * u * u);
}
__device__ float G(const Constants& c, float r) {
  const float q = r / c.h, u = fmaxf(0, 2 - q), unit = 1 / (3.14159265f * c.h * c.h * c.h * c.h * c.h);
  if (c.kernel == DECANT_MUELLER_2003) return q > 0 ? 45.0f / 64 * unit * u * u / q : 0;
  if (c.kernel == DECANT_WENDLAND_C2) return 105.0f / 128 * unit * u * u * u;
  return unit * (q < 1 ? 3 - 2.25f * q : 0.75f * u * u / q);
}
__device__ float L(const Constants& c, float r) {
  if (c.kernel != DECANT_MUELLER_2003) return 2 * r * r * G(c, r) / (r * r + 0.01f * c.h * c.h);
  return 45.0f / 64 / (3.14159265f * c.h * c.h * c.h * c.h * c.h) * fmaxf(0, 2 - r / c.h);
}

/// Everything within `reach` of each fluid particle; a list that is full says so by its count.
__global__ void build(Constants c, float reach, int capacity, int n, const float3* x, int targets, const float3* y,
                      bool own, int* count, int* list) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= n) return;
  int found = 0;
  for (int j = 0; j < targets; ++j)
    if (!(own && j == i) && squared(minus(c, x[i], y[j])) < reach * reach) {
      if (found < capacity) list[i * capacity + found] = j;
      ++found;
    }
  count[i] = found;
}

__global__ void sum_densities(Constants c, int capacity, int wall_capacity, int n, const float3* x,
                              const float3* wall_x, const float* V, const int* count, const int* list,
                              const int* wall_count, const int* walls, Sums* out) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= n) return;
  Sums s{0, 0, c.m * W(c, 0), 0, 0, 0, {}, {}, {}, {}};
  for (int k = 0; k < count[i]; ++k) {
    const int j = list[i * capacity + k];
    const float r2 = squared(minus(c, x[i], x[j]));
    if (r2 < c.H * c.H) s.density += c.m * W(c, sqrtf(r2)), ++s.fluid_count, s.fluid_sum += j;
  }
  for (int k = 0; k < wall_count[i]; ++k) {
    const int b = walls[i * wall_capacity + k];
    const float r2 = squared(minus(c, x[i], wall_x[b]));
    if (r2 < c.H * c.H) s.density += c.rho0 * V[b] * W(c, sqrtf(r2)), ++s.wall_count, s.wall_sum += b;
  }
  out[i] = s;
}

__global__ void sum_forces(Constants c, int capacity, int wall_capacity, int n, const float3* x, const float3* v,
                           const float3* wall_x, const float3* wall_v, const float* V, const float2* rho_p,
                           const int* count, const int* list, const int* wall_count, const int* walls, Sums* out) {
  const int i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= n) return;
  const float rho = rho_p[i].x, qi = rho_p[i].y / (rho * rho);
  for (int k = 0; k < count[i]; ++k) {
    const int j = list[i * capacity + k];
    const float3 d = minus(c, x[i], x[j]);
    const float r = sqrtf(squared(d)), rho_j = rho_p[j].x;
    if (squared(d) >= c.H * c.H) continue;
    add(out[i].pressure, c.m * (qi + rho_p[j].y / (rho_j * rho_j)) * G(c, r), d);
    add(out[i].viscous, c.mu / rho * c.m / rho_j * L(c, r), between(v[i], v[j]));
  }
  for (int k = 0; k < wall_count[i]; ++k) {
    const int b = walls[i * wall_capacity + k];
    const float3 d = minus(c, x[i], wall_x[b]);
    const float r = sqrtf(squared(d));
    if (squared(d) >= c.H * c.H) continue;
    add(out[i].wall_pressure, c.rho0 * V[b] * qi * G(c, r), d);
    add(out[i].wall_viscous, c.mu_w / rho * V[b] * L(c, r), between(v[i], wall_v[b]));
  }
}
