/// \file
/// The stages of a substep as one functor each. Those that sum over neighbors are templates on a
/// query, the only thing in which backends differ:
///   query.each(team, x, points, visit)     visit(k, j, point_j, d, r2) for every particle j != i with
///                                          r < H, fluid (j < Arrays::base) and wall, of each particle
///                                          i = team.particle(k); point_j is points[j], d = x[k] − x_j
///                                          by the nearest image, r2 = |d|²
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
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::held];
    Sum sum[Team::held];
#pragma unroll
    for (int k = 0; k < Team::held; ++k) {
      x[k] = xyz(a.now.position[team.particle(k)]);
      sum[k] = {0.0f, 0, 0, 0, 0};
    }
    with_kernel(c, [&](auto kernel) DECANT_INLINE {
      // The particle itself is counted once.
      const float own = team.leads() ? c.mass * kernel.w(c, {0.0f, 0.0f}) : 0.0f;
#pragma unroll
      for (int k = 0; k < Team::held; ++k) sum[k].density = own;
      query.each(team, x, a.now.position,
                 [&](int k, int j, float4 other, Float3, float r2) DECANT_INLINE {
        sum[k].density += query.weight(j, other) * kernel.w(c, radius(r2));
        if constexpr (facts) {
          if (!(r2 < c.H2)) return;
          if (j < a.base) {
            ++sum[k].fluid_count;
            sum[k].fluid_ids += a.id[j];
          } else {
            ++sum[k].wall_count;
            sum[k].wall_ids += wall_id[j - a.base];
          }
        }
      });
    });
#pragma unroll
    for (int k = 0; k < Team::held; ++k) tell(team, k, x[k], sum[k]);
  }

 private:
  DECANT_DEVICE void begin_substep() const {
    ++a.mailbox->begun;
    const DevicePose* poses = a.poses_after();
    float step = 0.0f;
    for (int k = 0; k < a.containers && !facts; ++k) step = fmaxf(step, poses[k].step);
    a.mailbox->wall_step = step;
    a.mailbox->wall_way += step;
  }
  struct Sum {
    float density;
    int fluid_count, wall_count;
    long long fluid_ids, wall_ids;
  };

  template <class Team>
  DECANT_DEVICE void tell(Team& team, int k, Float3 x, Sum sum) const {
    const float density = team.sum(sum.density);
    if constexpr (facts) {
      sum.fluid_count = team.sum(sum.fluid_count);
      sum.fluid_ids = team.sum(sum.fluid_ids);
      sum.wall_count = team.sum(sum.wall_count);
      sum.wall_ids = team.sum(sum.wall_ids);
    }
    if (!team.active(k) || !team.leads()) return;
    const int i = team.particle(k);
    if (i == 0) begin_substep();
    const float p = pressure_at(c, density);
    const float4 v = a.now.velocity[i];
    a.point[i] = make_float4(x.x, x.y, x.z, p / (density * density));
    a.motion[i] = make_float4(v.x, v.y, v.z, 1.0f / density);
    if constexpr (facts) {
      const int id = a.id[i];
      out.density[id] = density;
      out.pressure[id] = p;
      out.fluid_count[id] = sum.fluid_count;
      out.fluid_id_sum[id] = sum.fluid_ids;
      out.wall_count[id] = sum.wall_count;
      out.wall_id_sum[id] = sum.wall_ids;
    }
  }
};

/// What neighbors read, from density and pressure given from outside, by id; and the pressure that follows
/// from that density, which stands in for one that is not given.
struct GivenPass {
  Constants c;
  Arrays a;
  const float *density, *pressure;  // pressure null: not given
  float* own_pressure;

  DECANT_DEVICE void operator()(int i) const {
    const int id = a.id[i];
    const float own = pressure_at(c, density[id]);
    own_pressure[id] = own;
    a.point[i].w = (pressure ? pressure[id] : own) / (density[id] * density[id]);
    a.motion[i].w = 1.0f / density[id];
  }
};

/// What becomes of accelerations: they are kept for a pass of its own.
struct KeepAcceleration {
  Arrays a;
  DECANT_DEVICE void operator()(int i, Float3, Float3, Float3 acceleration) const {
    a.acceleration[i] = make_float4(acceleration.x, acceleration.y, acceleration.z, 0.0f);
  }
};

/// Acceleration, all that `advance` needs, for then(i, x, v, acceleration); with `facts` its parts, by id.
/// With w_j = m and ν_j = μ m/ρ_j
/// of fluid, w_b = ρ0 V_b and ν_b = μ_w V_b of a wall particle, both are
/// Σ w_j (p_i/ρ_i² + p_j/ρ_j²) G x_ij + (1/ρ_i) Σ ν_j (v_j − v_i) L.
template <class Query, bool facts, class Then = KeepAcceleration>
struct ForcePass {
  Constants c;
  Arrays a;
  Query query;
  FieldArrays out;
  Then then;

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::held];
    Own own[Team::held];
    Sum sum[Team::held];
#pragma unroll
    for (int k = 0; k < Team::held; ++k) {
      const float4 point = a.point[team.particle(k)], motion = a.motion[team.particle(k)];
      x[k] = xyz(point);
      own[k] = {xyz(motion), point.w, motion.w};
      sum[k] = {};
    }
    const float fluid_viscosity = c.viscosity * c.mass;
    with_kernel(c, [&](auto kernel) DECANT_INLINE {
      query.each(team, x, a.point,
                 [&](int k, int j, float4 other, Float3 d, float r2) DECANT_INLINE {
        const Radius r = radius(r2);
        const float g = kernel.g(c, r);
        const float4 moves = a.motion[j];
        const bool wall = j >= a.base;
        const float weight = wall ? c.rest_density * moves.w : c.mass;
        const float drag = moves.w * (wall ? c.wall_viscosity : fluid_viscosity);
        const Float3 push = (weight * (own[k].q + query.pressure_term(j, other)) * g) * d;
        const Float3 pull = (drag * kernel.l(c, r, r2, g)) * (xyz(moves) - own[k].v);
        if constexpr (facts) {
          if (wall) {
            sum[k].wall_pressure = sum[k].wall_pressure + push;
            sum[k].wall_viscous = sum[k].wall_viscous + pull;
            return;
          }
        }
        sum[k].pressure = sum[k].pressure + push;
        sum[k].viscous = sum[k].viscous + pull;
      });
    });
#pragma unroll
    for (int k = 0; k < Team::held; ++k) finish(team, k, x[k], own[k], sum[k]);
  }

 private:
  struct Own {
    Float3 v;
    float q, inverse_density;  // q = p/ρ²
  };
  struct Sum {
    Float3 pressure, viscous, wall_pressure, wall_viscous;
  };

  template <class Team>
  DECANT_DEVICE void finish(Team& team, int k, Float3 x, Own own, Sum s) const {
    const int i = team.particle(k);
    const bool writes = team.active(k) && team.leads();
    const float inverse_density = own.inverse_density;
    s.viscous = inverse_density * s.viscous;
    if constexpr (facts) {
      s.pressure = total(team, s.pressure);
      s.viscous = total(team, s.viscous);
      s.wall_pressure = total(team, s.wall_pressure);
      s.wall_viscous = total(team, inverse_density * s.wall_viscous);
      if (!writes) return;
      const Float3 sum =
          (s.pressure + s.wall_pressure) + (s.viscous + s.wall_viscous) + c.gravity;
      const int id = a.id[i];
      // A position that is no number is nobody's neighbor, and falls as if it were alone.
      if (!is_finite(sum) || !is_finite(x)) report(&a.mailbox->non_finite, 0, id);
      tell(out.pressure_acceleration, id, s.pressure);
      tell(out.viscous_acceleration, id, s.viscous);
      tell(out.wall_pressure_acceleration, id, s.wall_pressure);
      tell(out.wall_viscous_acceleration, id, s.wall_viscous);
      tell(out.acceleration, id, sum);
    } else {
      const Float3 sum = total(team, s.pressure + s.viscous) + c.gravity;
      if (writes) then(i, x, own.v, sum);
    }
  }
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
  struct Seen {};
  DECANT_DEVICE Seen look(int) const { return {}; }
  DECANT_DEVICE void operator()(int, Float3, Seen) const {}
};

/// Semi-implicit Euler, periodic wrap, contact at the end of the substep, checks. after(i, x, seen) sees
/// the new position, and what after.look(i) has fetched together with what is read here. Contact is left
/// out where a particle and the walls have not moved enough since its distance from them was last seen
/// for a touch.
template <class After>
struct Mover {
  Constants c;
  Arrays a;
  DeviceGeometry geometry;
  After after;

  DECANT_DEVICE void operator()(int i, Float3 x, Float3 v, Float3 acceleration) const {
    const auto seen = after.look(i);
    const float was_clear = a.now.velocity[i].w, wall_step = a.mailbox->wall_step;
    if (i == 0) ++a.mailbox->ended;
    v = v + c.dt * acceleration;
    const Float3 way = c.dt * v;
    x = x + way;
    x = {wrap(0, x.x), wrap(1, x.y), wrap(2, x.z)};
    const float rounding = rounding_of(x);
    float clear = was_clear - (1.001f * (sqrtf(dot(way, way)) + wall_step) + rounding);
    if (!(clear > 1.001f * c.contact_distance + rounding))
      clear = collide(c, geometry, a.poses_after(), x, v);
    if (collide_with_floor(c, x, v)) clear = 0.0f;
    if (!is_finite(x) || !is_finite(v))
      report(&a.mailbox->non_finite, a.mailbox->begun, a.id[i]);
    else if (escaped(0, x.x) || escaped(1, x.y) || escaped(2, x.z))
      report(&a.mailbox->escaped, a.mailbox->begun, a.id[i]);
    a.next.position[i] = a.square ? point_at(x) : make_float4(x.x, x.y, x.z, c.mass);
    a.next.velocity[i] = make_float4(v.x, v.y, v.z, clear);
    after(i, x, seen);
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

/// Moves particles by the accelerations that were kept; threads after the particles' place moving walls at
/// the end of the substep.
template <class After>
struct IntegratePass {
  Mover<After> move;
  PosePass moving;

  DECANT_DEVICE void operator()(int i) const {
    const Arrays& a = move.a;
    if (i >= a.n) return moving(i - a.n);
    move(i, xyz(a.point[i]), xyz(a.motion[i]), xyz(a.acceleration[i]));
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
