/// \file
/// The stages of a substep as one functor each. Those that sum over neighbors are templates on a
/// query, the only thing in which backends differ:
///   query.fluid(team, x_i, visit)          visit(j, d, r2) for every fluid j with r < H, i included
///   query.wall(team, x_i, visit)           the same for wall particles in the world
///   query.wall_frame(team, x_b, visit)     the same for wall particles in their own frames
/// with d = x_i − x_j by the nearest image and r2 = |d|². A visit may come on any lane of the team.
#pragma once

#include "gpu/contact.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// Device arrays of one scene. Fluid and wall positions are padded to whole tiles with points that
/// are far from everything.
struct Arrays {
  int n, m;                  // fluid, wall particles
  float4 *position, *velocity;          // xyz and |x|²; xyz
  float *density, *pressure;
  float2* thermo;                       // p/rho², 1/rho, what neighbors read
  float4 *pressure_acceleration, *viscous_acceleration, *wall_pressure_acceleration,
      *wall_viscous_acceleration, *acceleration;
  long long *fluid_count, *fluid_id_sum, *wall_count, *wall_id_sum;
  float4* wall_local;                   // xyz and |x|² in the container's frame
  float4* wall;                         // xyz and |x|² in the world
  float4* wall_velocity;
  float* wall_volume;                   // V_b
  int* wall_container;
  unsigned long long* trouble;          // [0] non-finite, [1] escaped: (substep << 32) | particle
};

DECANT_DEVICE bool is_finite(Float3 v) {
  return fabsf(v.x) <= 3.0e38f && fabsf(v.y) <= 3.0e38f && fabsf(v.z) <= 3.0e38f;
}

DECANT_DEVICE void report(unsigned long long* word, unsigned substep, int particle) {
  atomic_minimum(word, (static_cast<unsigned long long>(substep) << 32) |
                           static_cast<unsigned>(particle));
}

/// Wall particles [first, first + count) to their place in the world at one time.
struct PosePass {
  Arrays a;
  const DevicePose* poses;  // one a container
  int first;

  DECANT_DEVICE void operator()(int k) const {
    const int b = first + k;
    const DevicePose& pose = poses[a.wall_container[b]];
    const Float3 x = rotate(pose, xyz(a.wall_local[b])) + pose.translation;
    const Float3 v = cross(pose.omega, x - pose.pivot);
    a.wall[b] = point_at(x);
    a.wall_velocity[b] = make_float4(v.x, v.y, v.z, 0.0f);
  }
};

/// V_b = 1 / Σ_k W_bk over the wall particles of the same container, itself included.
template <class Query>
struct VolumePass {
  Constants c;
  Arrays a;
  Query query;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team, int b, bool active) const {
    const int container = a.wall_container[b];
    float sum = 0.0f;
    query.wall_frame(team, xyz(a.wall_local[b]), [&](int k, Float3, float r2) {
      if (a.wall_container[k] == container) sum += kernel_w(c, sqrtf(r2));
    });
    sum = team.sum(sum);
    if (active && team.leads()) a.wall_volume[b] = 1.0f / sum;
  }
};

/// Density, pressure and the neighbor facts of every fluid particle.
template <class Query>
struct DensityPass {
  Constants c;
  Arrays a;
  Query query;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team, int i, bool active) const {
    const Float3 x = xyz(a.position[i]);
    float fluid = 0.0f, wall = 0.0f;
    int fluid_count = 0, wall_count = 0;
    long long fluid_ids = 0, wall_ids = 0;
    query.fluid(team, x, [&](int j, Float3, float r2) {
      fluid += kernel_w(c, sqrtf(r2));
      if (j == i) return;
      ++fluid_count;
      fluid_ids += j;
    });
    query.wall(team, x, [&](int b, Float3, float r2) {
      wall += a.wall_volume[b] * kernel_w(c, sqrtf(r2));
      ++wall_count;
      wall_ids += b;
    });
    fluid = team.sum(fluid);
    wall = team.sum(wall);
    fluid_count = team.sum(fluid_count);
    wall_count = team.sum(wall_count);
    fluid_ids = team.sum(fluid_ids);
    wall_ids = team.sum(wall_ids);
    if (!active || !team.leads()) return;
    const float density = c.mass * fluid + c.rest_density * wall;
    const float p = pressure_at(c, density);
    a.density[i] = density;
    a.pressure[i] = p;
    a.thermo[i] = make_float2(p / (density * density), 1.0f / density);
    a.fluid_count[i] = fluid_count;
    a.fluid_id_sum[i] = fluid_ids;
    a.wall_count[i] = wall_count;
    a.wall_id_sum[i] = wall_ids;
  }
};

/// What neighbors read, from density and pressure given from outside.
struct ThermoPass {
  Arrays a;
  const float *density, *pressure;

  DECANT_DEVICE void operator()(int i) const {
    a.thermo[i] = make_float2(pressure[i] / (density[i] * density[i]), 1.0f / density[i]);
  }
};

/// The four parts of the acceleration and their sum with gravity.
template <class Query>
struct ForcePass {
  Constants c;
  Arrays a;
  Query query;
  unsigned substep;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team, int i, bool active) const {
    const Float3 x = xyz(a.position[i]), v = xyz(a.velocity[i]);
    const float q = a.thermo[i].x, inverse_density = a.thermo[i].y;
    Float3 pressure{0, 0, 0}, viscous{0, 0, 0}, wall_pressure{0, 0, 0}, wall_viscous{0, 0, 0};
    query.fluid(team, x, [&](int j, Float3 d, float r2) {
      const float r = sqrtf(r2), g = kernel_g(c, r);
      const float2 other = a.thermo[j];
      pressure = pressure + ((q + other.x) * g) * d;
      viscous = viscous + (other.y * kernel_l(c, r, g)) * (xyz(a.velocity[j]) - v);
    });
    query.wall(team, x, [&](int b, Float3 d, float r2) {
      const float r = sqrtf(r2), g = kernel_g(c, r), volume = a.wall_volume[b];
      wall_pressure = wall_pressure + (volume * g) * d;
      wall_viscous = wall_viscous + (volume * kernel_l(c, r, g)) * (xyz(a.wall_velocity[b]) - v);
    });
    const Float3 p = c.mass * total(team, pressure);
    const Float3 f = (c.viscosity * inverse_density * c.mass) * total(team, viscous);
    const Float3 wp = (c.rest_density * q) * total(team, wall_pressure);
    const Float3 wf = (c.wall_viscosity * inverse_density) * total(team, wall_viscous);
    if (!active || !team.leads()) return;
    const Float3 sum = (p + wp) + (f + wf) + c.gravity;
    if (!is_finite(sum)) report(a.trouble, substep, i);
    a.pressure_acceleration[i] = make_float4(p.x, p.y, p.z, 0.0f);
    a.viscous_acceleration[i] = make_float4(f.x, f.y, f.z, 0.0f);
    a.wall_pressure_acceleration[i] = make_float4(wp.x, wp.y, wp.z, 0.0f);
    a.wall_viscous_acceleration[i] = make_float4(wf.x, wf.y, wf.z, 0.0f);
    a.acceleration[i] = make_float4(sum.x, sum.y, sum.z, 0.0f);
  }

 private:
  template <class Team>
  DECANT_DEVICE static Float3 total(const Team& team, Float3 v) {
    return {team.sum(v.x), team.sum(v.y), team.sum(v.z)};
  }
};

/// Semi-implicit Euler, periodic wrap, contact at the end of the substep, checks.
struct IntegratePass {
  Constants c;
  Arrays a;
  DeviceGeometry geometry;
  const DevicePose* poses;  // at the end of the substep
  unsigned substep;         // counted from 1 within this advance

  DECANT_DEVICE static float wrap(const Constants& c, int axis, float x) {
    if (!c.periodic[axis]) return x;
    return x - c.period[axis] * floorf((x - c.domain_min[axis]) * c.inverse_period[axis]);
  }
  DECANT_DEVICE bool escaped(int axis, float x) const {
    return !c.periodic[axis] && !(x >= c.domain_min[axis] && x <= c.domain_max[axis]);
  }

  DECANT_DEVICE void operator()(int i) const {
    Float3 x = xyz(a.position[i]), v = xyz(a.velocity[i]);
    v = v + c.dt * xyz(a.acceleration[i]);
    x = x + c.dt * v;
    x = {wrap(c, 0, x.x), wrap(c, 1, x.y), wrap(c, 2, x.z)};
    collide(c, geometry, poses, x, v);
    if (!is_finite(x) || !is_finite(v))
      report(a.trouble, substep, i);
    else if (escaped(0, x.x) || escaped(1, x.y) || escaped(2, x.z))
      report(a.trouble + 1, substep, i);
    a.position[i] = point_at(x);
    a.velocity[i] = make_float4(v.x, v.y, v.z, 0.0f);
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
