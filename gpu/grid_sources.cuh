/// \file
/// What GridSearch sorts, and what it notes down on the way: fluid with the origins of its displacements,
/// walls in their frames or in the world.
#pragma once

#include "gpu/search.cuh"
#include "gpu/sort.cuh"
#include "gpu/trigger.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// Fluid on its way into the order of its cells.
struct FluidSource {
  Constants c;
  Arrays a;
  Particles from, into;
  // Of lists that are kept, and the bucket only for the local trigger; null otherwise.
  int* bucket;
  float4* origin;
  DeviceGeometry geometry;

  /// What the density pass has not written yet.
  int2* desk() const { return reinterpret_cast<int2*>(a.point); }
  /// Of lists that are kept, where it will be halfway through their time, if that is not too far. Asked
  /// twice, once for the cell and once for the list, and two copies of an expression may be rounded
  /// apart: so it must not jump where they could be.
  DECANT_DEVICE Float3 position(int i) const {
    const Float3 x = xyz(from.position[i]);
    if (!origin) return x;
    const float most = 0.5f * sound_skin(a.mailbox->skin), limit = 0.999f * most;
    // Where rounding counts beside the skin, far out, it is as near as it can be.
    if (!(0x1p-22f * (fabsf(x.x) + fabsf(x.y) + fabsf(x.z)) <= 0.001f * most)) return x;
    const Float3 way = a.mailbox->ahead * xyz(from.velocity[i]);
    const float square = dot(way, way);
    const Float3 there = x + (square > limit * limit ? limit * radius(square).inverse : 1.0f) * way;
    return is_finite(there) ? there : x;
  }
  DECANT_DEVICE int id(int i) const { return a.id[i]; }
  DECANT_DEVICE int rank(int i) const { return a.id[i]; }
  DECANT_DEVICE void begin() const {
    a.mailbox->stale = 0;
    a.mailbox->wall_way = 0.0f;
    ++a.mailbox->rebuilds;
  }
  DECANT_DEVICE void place(int i, int id, int to, int in_bucket) const {
    into.position[to] = from.position[i];
    into.velocity[to] = from.velocity[i];
    a.id[to] = id;
    if (origin) note(to, in_bucket, position(i));
  }
  /// What there is to remember of the build.
  DECANT_DEVICE void note(int to, int in_bucket, Float3 x) const {
    float way = 0.0f;
    if (bucket) {
      bucket[to] = in_bucket;
      way = fmaxf(clearance(c, geometry, a.poses_before(), x) - c.H, sound_skin(a.mailbox->skin));
    }
    origin[to] = make_float4(x.x, x.y, x.z, way);
  }
};

/// A container's wall particles on their way into the order of the cells of their frame.
struct FrameWallSource {
  const float4* from;
  const int* from_id;
  float4* local;
  int* to_id;
  int2* room;  // as many

  int2* desk() const { return room; }
  DECANT_DEVICE Float3 position(int k) const { return xyz(from[k]); }
  DECANT_DEVICE int id(int k) const { return from_id[k]; }
  DECANT_DEVICE int rank(int k) const { return k; }
  DECANT_DEVICE void begin() const {}
  DECANT_DEVICE void place(int k, int id, int to, int) const {
    local[to] = from[k];
    to_id[to] = id;
  }
};

/// The same into the order of cells in the world, as it stands at the start of the substep.
struct WorldWallSource {
  Arrays a;
  Walls walls;
  FrameWallSource frame;
  int first, container;

  int2* desk() const { return frame.room; }
  DECANT_DEVICE Float3 position(int k) const {
    const DevicePose& pose = a.poses_before()[container];
    return rotate(pose, frame.position(k)) + pose.translation;
  }
  DECANT_DEVICE int id(int k) const { return frame.id(k); }
  DECANT_DEVICE int rank(int k) const { return k; }
  DECANT_DEVICE void begin() const {}
  DECANT_DEVICE void place(int k, int id, int to, int bucket) const {
    frame.place(k, id, to, bucket);
    place_wall(a, walls, first + to, position(k), id, a.poses_before()[container]);
  }
};

/// Lists from all pairs: particles stay where they are.
struct StayPass {
  FluidSource source;
  DECANT_DEVICE void operator()(int i) const {
    if (i == 0) source.begin();
    source.note(i, 0, source.position(i));
  }
};

/// After a substep's integration: counts for the sort of the next one.
struct CountCell {
  KeyPass<FluidSource> counter;
  struct Seen {};
  DECANT_DEVICE Seen look(int) const { return {}; }
  DECANT_DEVICE void operator()(int i, Float3 x, Seen) const { counter.count_in(i, x); }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
