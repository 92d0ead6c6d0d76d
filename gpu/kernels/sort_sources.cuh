/// \file
/// What is sorted into cells, and what is stored on the way: fluid, with the origins of its displacements where
/// lists are kept; walls in their frames or in the world.
#pragma once

#include "gpu/kernels/cell_sort.cuh"
#include "gpu/kernels/place_walls.cuh"
#include "gpu/kernels/rebuild_criterion.cuh"

namespace decant::gpu {
namespace {

/// Fluid on its way into the order of its cells.
struct FluidSource {
  Constants c;
  ParticleArrays a;
  Particles from, into;
  // Of lists that are kept, and the bucket only for the relative criterion; null otherwise.
  int* bucket;
  float4* origin;
  DeviceGeometry geometry;

  /// What the density kernel has not written yet.
  int2* scratch() const { return reinterpret_cast<int2*>(a.force_position); }
  /// Of lists that are kept, where it will be halfway through their time, if that is not too far. Asked
  /// twice, once for the cell and once for the list, and two copies of an expression may be rounded
  /// apart: so it must not jump where they could be.
  DECANT_DEVICE Float3 position(int i) const {
    const Float3 x = xyz(from.position[i]);
    if (!origin) return x;
    const float most = 0.5f * sound_skin(a.status->skin), limit = 0.999f * most;
    // Where rounding counts beside the skin, far out, it is as near as it can be.
    if (!(0x1p-22f * (fabsf(x.x) + fabsf(x.y) + fabsf(x.z)) <= 0.001f * most)) return x;
    const Float3 displacement = a.status->prediction_time * xyz(from.velocity[i]);
    const float square = dot(displacement, displacement);
    const Float3 there = x + (square > limit * limit ? limit * radius(square).inverse : 1.0f) * displacement;
    return is_finite(there) ? there : x;
  }
  DECANT_DEVICE int id(int i) const { return a.id[i]; }
  DECANT_DEVICE int rank(int i) const { return a.id[i]; }
  DECANT_DEVICE void begin() const {
    a.status->rebuild_needed = 0;
    a.status->wall_displacement = 0.0f;
    ++a.status->rebuilds;
  }
  DECANT_DEVICE void place(int i, int id, int to, int in_bucket) const {
    into.position[to] = from.position[i];
    into.velocity[to] = from.velocity[i];
    a.id[to] = id;
    if (a.index) a.index[id] = to;
    if (origin) store_origin(to, in_bucket, position(i));
  }
  /// What the rebuild criterion asks for later.
  DECANT_DEVICE void store_origin(int to, int in_bucket, Float3 x) const {
    float against_walls = 0.0f;
    if (bucket) {
      bucket[to] = in_bucket;
      against_walls = fmaxf(clearance(c, geometry, a.poses_before(), x) - c.H, sound_skin(a.status->skin));
    }
    origin[to] = make_float4(x.x, x.y, x.z, against_walls);
  }
};

/// A container's wall particles on their way into the order of the cells of their frame.
struct FrameWallSource {
  const float4* from;
  const int* from_id;
  float4* local;
  int* to_id;
  int2* room;  // as many
  int first_id;

  int2* scratch() const { return room; }
  DECANT_DEVICE Float3 position(int k) const { return xyz(from[k]); }
  DECANT_DEVICE int id(int k) const { return from_id[k]; }
  DECANT_DEVICE int rank(int k) const { return from_id[k] - first_id; }
  DECANT_DEVICE void begin() const {}
  DECANT_DEVICE void place(int k, int id, int to, int) const {
    local[to] = from[k];
    to_id[to] = id;
  }
};

/// The same into the order of cells in the world, as it stands at the start of the substep.
struct WorldWallSource {
  ParticleArrays a;
  Walls walls;
  FrameWallSource frame;
  int first, container;

  int2* scratch() const { return frame.room; }
  DECANT_DEVICE Float3 position(int k) const {
    const DevicePose& pose = a.poses_before()[container];
    return rotate(pose, frame.position(k)) + pose.translation;
  }
  DECANT_DEVICE int id(int k) const { return frame.id(k); }
  DECANT_DEVICE int rank(int k) const { return frame.rank(k); }
  DECANT_DEVICE void begin() const {}
  DECANT_DEVICE void place(int k, int id, int to, int bucket) const {
    frame.place(k, id, to, bucket);
    place_wall(a, walls, first + to, position(k), id, a.poses_before()[container]);
  }
};

/// Lists from all pairs: particles keep their order.
struct KeepOrder {
  FluidSource source;
  DECANT_DEVICE void operator()(int i) const {
    if (i == 0) source.begin();
    source.store_origin(i, 0, source.position(i));
  }
};
DECANT_KERNEL(256) keep_order_kernel(int n, KeepOrder keep) { for_each_thread(n, keep); }

/// After a substep's integration: counts for the sort of the next one.
struct CountForNextSort {
  CountInCells<FluidSource> counter;
  struct Prefetched {};
  DECANT_DEVICE Prefetched prefetch(int) const { return {}; }
  DECANT_DEVICE void operator()(int i, Float3 x, Prefetched) const { counter.count_in(i, x); }
};

}  // namespace
}  // namespace decant::gpu
