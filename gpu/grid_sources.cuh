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
  DevicePose* built;
  DeviceGeometry geometry;

  /// What the density pass has not written yet.
  int2* desk() const { return reinterpret_cast<int2*>(a.point); }
  DECANT_DEVICE Float3 position(int i) const { return xyz(from.position[i]); }
  DECANT_DEVICE int id(int i) const { return a.id[i]; }
  DECANT_DEVICE void begin() const {
    a.mailbox->stale = 0;
    ++a.mailbox->rebuilds;
  }
  DECANT_DEVICE void place(int i, int id, int to, int in_bucket) const {
    const float4 x = from.position[i];
    into.position[to] = x;
    into.velocity[to] = from.velocity[i];
    a.id[to] = id;
    note(to, in_bucket, x);
  }
  /// What there is to remember of the build.
  DECANT_DEVICE void note(int to, int in_bucket, float4 x) const {
    if (bucket) bucket[to] = in_bucket;
    if (!origin) return;
    const DevicePose* poses = a.poses_before();
    const float skin = sound_skin(a.mailbox->skin);
    const float far = clearance(c, geometry, poses, xyz(x)) - c.H;
    origin[to] = make_float4(x.x, x.y, x.z, far > skin ? far : skin);
    if (to < a.containers) built[to] = poses[to];
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
    source.note(i, 0, source.from.position[i]);
  }
};

/// After a substep's integration: counts for the sort of the next one.
struct CountCell {
  KeyPass<FluidSource> counter;
  DECANT_DEVICE void operator()(int i, Float3 x, const DevicePose*) const { counter.count_in(i, x); }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
