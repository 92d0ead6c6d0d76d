/// \file
/// The end of a substep: semi-implicit Euler, periodic wrap, contact with containers and floor, and the checks
/// of the device status.
#pragma once

#include "gpu/kernels/place_walls.cuh"

namespace decant::gpu {
namespace {

/// What else becomes of a particle at its new position: nothing.
struct NothingElse {
  struct Prefetched {};
  DECANT_DEVICE Prefetched prefetch(int) const { return {}; }
  DECANT_DEVICE void operator()(int, Float3, Prefetched) const {}
};

/// Moves particle i. after(i, x, prefetched) sees the new position, and what after.prefetch(i) has read
/// together with what is read here. Contact is left out where a particle and the walls have not moved enough
/// since its clearance was last computed for a touch.
template <class After>
struct Integrate {
  Constants c;
  ParticleArrays a;
  DeviceGeometry geometry;
  After after;

  /// What has become of a particle in a substep, so far.
  struct Moved {
    Float3 x, v, free_of_contact, displacement;
    float clearance;  // that walls keep from it at least; see may_touch
  };

  /// By all threads of the particle's team.
  static constexpr bool by_team = true;
  template <class Team>
  DECANT_DEVICE void operator()(const Team& team, int i, Float3 x, Float3 v, Float3 acceleration) const {
    const auto prefetched = after.prefetch(i);
    Moved m = move(x, v, acceleration, a.current.velocity[i].w, a.status->wall_step);
    if (may_touch(m)) touch(team, a.poses_after(), m);
    if (team.is_leader()) store(i, m, prefetched);
  }
  /// Free of contact.
  DECANT_DEVICE Moved move(Float3 x, Float3 v, Float3 acceleration, float clearance, float wall_step) const {
    v = v + c.dt * acceleration;
    const Float3 displacement = c.dt * v;
    x = x + displacement;
    x = {wrap(0, x.x), wrap(1, x.y), wrap(2, x.z)};
    const float rounding = rounding_of(x);
    return {x, v, x, displacement,
            clearance - (1.001f * (sqrtf(dot(displacement, displacement)) + wall_step) + rounding)};
  }
  DECANT_DEVICE bool may_touch(const Moved& m) const {
    return !(m.clearance > 1.001f * c.contact_distance + rounding_of(m.x));
  }
  template <class Team>
  DECANT_DEVICE void touch(const Team& team, const DevicePose* poses, Moved& m) const {
    m.clearance = collide(team, c, geometry, poses, m.x, m.v);
  }
  /// The floor, the checks, and the state at the end of the substep.
  DECANT_DEVICE void store(int i, Moved& m, const typename After::Prefetched& prefetched) const {
    Float3 &x = m.x, &v = m.v;
    if (collide_with_floor(c, x, v)) m.clearance = 0.0f;
    if (i == 0) ++a.status->substeps_ended;
    if (a.farthest) note_displacement(m.displacement + (x - m.free_of_contact));
    if (!is_finite(x) || !is_finite(v)) report(&a.status->non_finite, a.status->substeps_begun, a.id[i]);
    else if (escaped(0, x.x) || escaped(1, x.y) || escaped(2, x.z))
      report(&a.status->escaped, a.status->substeps_begun, a.id[i]);
    a.next.position[i] = a.stores_square ? with_square(x) : make_float4(x.x, x.y, x.z, c.mass);
    a.next.velocity[i] = make_float4(v.x, v.y, v.z, m.clearance);
    after(i, x, prefetched);
  }

 private:
  DECANT_DEVICE void note_displacement(Float3 d) const {
    const float square = dot(d, d);
    raise_to(a.farthest + a.status->substeps_begun - 1, square <= 3.0e38f ? square : 3.4e38f);  // NaN is far
  }
  DECANT_DEVICE float wrap(int axis, float x) const {
    if (!c.periodic[axis]) return x;
    return x - c.period[axis] * floorf((x - c.domain_min[axis]) * c.inverse_period[axis]);
  }
  DECANT_DEVICE bool escaped(int axis, float x) const {
    return !c.periodic[axis] && !(x >= c.domain_min[axis] && x <= c.domain_max[axis]);
  }
};

template <class After>
DECANT_DEVICE void integrate_stored(const Integrate<After>& integrate, int i) {
  const ParticleArrays& a = integrate.a;
  integrate(SubWarp<1>(i), i, xyz(a.force_position[i]), xyz(a.force_velocity[i]), xyz(a.acceleration[i]));
}

/// By the accelerations that were stored; threads after the particles' place moving walls at the end of the
/// substep.
template <class After>
DECANT_KERNEL(256)
integrate_kernel(int particles_and_walls, Integrate<After> integrate, PlaceWalls<WallsFor::both> walls) {
  for_each_thread(particles_and_walls, [&](int i) {
    const ParticleArrays& a = integrate.a;
    if (i >= a.n) return walls(i - a.n);
    if (!a.moves_apart(i)) integrate_stored(integrate, i);
    else if (i == 0 && a.is_ghost(i)) ++a.status->substeps_ended;
  });
}

/// The same of particles by their ids, before the others: they can be on their way to other ranks meanwhile.
template <class After>
DECANT_KERNEL(256)
integrate_border_kernel(int n, const int* ids, Integrate<After> integrate) {
  for_each_thread(n, [&](int k) { integrate_stored(integrate, integrate.a.index[ids[k]]); });
}

}  // namespace
}  // namespace decant::gpu
