/// \file
/// The stages of a substep as one functor each. Those that sum over neighbors are templates on a
/// query, the only thing in which backends differ:
///   query.each(team, i, x, points, visit)  visit(j, point_j, d, r2) for every particle j with r < H
///                                          except i, fluid (j < Arrays::base) and wall; point_j is
///                                          points[j], d = x − x_j by the nearest image, r2 = |d|²
///   query.weight(j, point_j)               density pass: m, or ρ0 V_j of a wall particle
///   query.pressure_term(j, point_j)        force pass: p/ρ² of j; 0 of a wall particle
/// A visit may come on any lane of the team, and also for pairs farther than H: kernels are 0 there, and
/// branches cost more than zeros.
#pragma once

#include "gpu/walls.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// Density, pressure and what neighbors read of them; with `facts` also what `evaluate` tells.
template <class Query, bool facts>
struct DensityPass {
  Constants c;
  Arrays a;
  Query query;
  FieldArrays out;
  const int* wall_id;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team, int i, bool active) const {
    const float4 own = a.now.position[i];
    const Float3 x = xyz(own);
    // The particle itself is counted once.
    float sum = team.leads() ? c.mass * kernel_w(c, {0.0f, 0.0f}) : 0.0f;
    int fluid_count = 0, wall_count = 0;
    long long fluid_ids = 0, wall_ids = 0;
    query.each(team, i, x, a.now.position, [&](int j, float4 other, Float3, float r2) DECANT_INLINE {
      sum += query.weight(j, other) * kernel_w(c, radius(r2));
      if constexpr (facts) {
        if (!(r2 < c.H2)) return;
        if (j < a.base) {
          ++fluid_count;
          fluid_ids += a.id[j];
        } else {
          ++wall_count;
          wall_ids += wall_id[j - a.base];
        }
      }
    });
    const float density = team.sum(sum);
    if constexpr (facts) {
      fluid_count = team.sum(fluid_count);
      fluid_ids = team.sum(fluid_ids);
      wall_count = team.sum(wall_count);
      wall_ids = team.sum(wall_ids);
    }
    if (!active || !team.leads()) return;
    const float p = pressure_at(c, density);
    const float4 v = a.now.velocity[i];
    a.point[i] = make_float4(x.x, x.y, x.z, p / (density * density));
    a.motion[i] = make_float4(v.x, v.y, v.z, 1.0f / density);
    if constexpr (facts) {
      const int id = a.id[i];
      out.density[id] = density;
      out.pressure[id] = p;
      out.fluid_count[id] = fluid_count;
      out.fluid_id_sum[id] = fluid_ids;
      out.wall_count[id] = wall_count;
      out.wall_id_sum[id] = wall_ids;
    }
  }
};

/// What neighbors read, from density and pressure given from outside, by id.
struct GivenPass {
  Arrays a;
  const float *density, *pressure;

  DECANT_DEVICE void operator()(int i) const {
    const int id = a.id[i];
    a.point[i].w = pressure[id] / (density[id] * density[id]);
    a.motion[i].w = 1.0f / density[id];
  }
};

/// Acceleration, all that `advance` needs; with `facts` its parts, by id. With w_j = m and ν_j = μ m/ρ_j
/// of fluid, w_b = ρ0 V_b and ν_b = μ_w V_b of a wall particle, both are
/// Σ w_j (p_i/ρ_i² + p_j/ρ_j²) G x_ij + (1/ρ_i) Σ ν_j (v_j − v_i) L.
template <class Query, bool facts>
struct ForcePass {
  Constants c;
  Arrays a;
  Query query;
  FieldArrays out;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team, int i, bool active) const {
    const float4 point = a.point[i], motion = a.motion[i];
    const Float3 x = xyz(point), v = xyz(motion);
    const float q = point.w, inverse_density = motion.w;
    const float fluid_viscosity = c.viscosity * c.mass;
    Float3 pressure{0, 0, 0}, viscous{0, 0, 0}, wall_pressure{0, 0, 0}, wall_viscous{0, 0, 0};
    query.each(team, i, x, a.point, [&](int j, float4 other, Float3 d, float r2) DECANT_INLINE {
      const Radius r = radius(r2);
      const float g = kernel_g(c, r);
      const float4 moves = read_only(a.motion + j);
      const bool wall = j >= a.base;
      const float weight = wall ? c.rest_density * moves.w : c.mass;
      const float drag = moves.w * (wall ? c.wall_viscosity : fluid_viscosity);
      const Float3 push = (weight * (q + query.pressure_term(j, other)) * g) * d;
      const Float3 pull = (drag * kernel_l(c, r, r2, g)) * (xyz(moves) - v);
      if constexpr (facts) {
        if (wall) {
          wall_pressure = wall_pressure + push;
          wall_viscous = wall_viscous + pull;
          return;
        }
      }
      pressure = pressure + push;
      viscous = viscous + pull;
    });
    viscous = inverse_density * viscous;
    if constexpr (facts) {
      pressure = total(team, pressure);
      viscous = total(team, viscous);
      wall_pressure = total(team, wall_pressure);
      wall_viscous = total(team, inverse_density * wall_viscous);
      if (!active || !team.leads()) return;
      const Float3 sum = (pressure + wall_pressure) + (viscous + wall_viscous) + c.gravity;
      const int id = a.id[i];
      // A position that is no number is nobody's neighbor, and falls as if it were alone.
      if (!is_finite(sum) || !is_finite(x)) report(&a.mailbox->non_finite, 0, id);
      tell(out.pressure_acceleration, id, pressure);
      tell(out.viscous_acceleration, id, viscous);
      tell(out.wall_pressure_acceleration, id, wall_pressure);
      tell(out.wall_viscous_acceleration, id, wall_viscous);
      tell(out.acceleration, id, sum);
    } else {
      const Float3 sum = total(team, pressure + viscous) + c.gravity;
      if (active && team.leads()) a.acceleration[i] = make_float4(sum.x, sum.y, sum.z, 0.0f);
    }
  }

 private:
  DECANT_DEVICE static void tell(float* to, int id, Float3 v) {
    const auto k = 3 * static_cast<std::size_t>(id);
    to[k] = v.x;
    to[k + 1] = v.y;
    to[k + 2] = v.z;
  }
  template <class Team>
  DECANT_DEVICE static Float3 total(const Team& team, Float3 v) {
    return {team.sum(v.x), team.sum(v.y), team.sum(v.z)};
  }
};

struct Nothing {
  DECANT_DEVICE void operator()(int, Float3) const {}
};

/// Semi-implicit Euler, periodic wrap, contact at the end of the substep, checks. `after`(i, x) sees
/// the new position. A pass of its own: contact wants one thread a particle where forces want several.
/// Threads after the particles' place moving walls at the end of the substep.
template <class After>
struct IntegratePass {
  Constants c;
  Arrays a;
  DeviceGeometry geometry;
  PosePass moving;
  After after;

  DECANT_DEVICE void operator()(int i) const {
    if (i >= a.n) return moving(i - a.n);
    Float3 x = xyz(a.point[i]), v = xyz(a.motion[i]);
    v = v + c.dt * xyz(a.acceleration[i]);
    x = x + c.dt * v;
    x = {wrap(0, x.x), wrap(1, x.y), wrap(2, x.z)};
    collide(c, geometry, a.poses_at_end(), x, v);
    if (!is_finite(x) || !is_finite(v))
      report(&a.mailbox->non_finite, a.mailbox->substep, a.id[i]);
    else if (escaped(0, x.x) || escaped(1, x.y) || escaped(2, x.z))
      report(&a.mailbox->escaped, a.mailbox->substep, a.id[i]);
    a.next.position[i] = point_at(x);
    a.next.velocity[i] = make_float4(v.x, v.y, v.z, 0.0f);
    after(i, x);
  }

 private:
  DECANT_DEVICE float wrap(int axis, float x) const {
    if (!c.periodic[axis]) return x;
    return x - c.period[axis] * floorf((x - c.domain_min[axis]) * c.inverse_period[axis]);
  }
  DECANT_DEVICE bool escaped(int axis, float x) const {
    return !c.periodic[axis] && !(x >= c.domain_min[axis] && x <= c.domain_max[axis]);
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
