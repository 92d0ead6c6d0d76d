/// \file
/// Wall particles. In kernels they are particles like any other, with a place in the world; moving
/// ones are placed anew at the end of every substep. They are looked up in their container's own frame,
/// where they never move: the grid of the moving source is built once, like that of the receiver.
#pragma once

#include "gpu/core/cell_table.cuh"
#include "gpu/core/teams.cuh"
#include "gpu/physics/contact.cuh"

namespace decant::gpu {
namespace {

/// One container's wall particles, slots [begin, end); begin is a multiple of tile_size.
struct WallSegment {
  int begin, end;
  int first_id;  // the ids of its wall particles follow each other
  CellTable table;
  Float3 low, high;  // no wall particle is within reach of a point outside, in the frame of lookups
  // By bucket, for a grid that is never rebuilt: which wall particles may be within reach of the cell,
  // near[near_start[bucket]] on. Null: to be looked up row by row.
  const int *near_start, *near;
  bool in_world;  // looked up in the world, not in the container's frame

  DECANT_DEVICE bool out_of_reach(Float3 x) const {
    return x.x < low.x || x.x > high.x || x.y < low.y || x.y > high.y || x.z < low.z || x.z > high.z;
  }
};

/// Slots of all containers, each padded to whole tiles; an id of −1 is padding.
struct Walls {
  float4* local;  // container frame
  int* id;
  const int* container;
  float* volume;  // V_b by id
  float rest_density;
};

/// Where densities see a wall particle.
DECANT_DEVICE void place_wall_for_density(const ParticleArrays& a, const Walls& w, int slot, Float3 x, int id) {
  a.current.position[a.base + slot] =
      a.stores_square ? with_square(x) : make_float4(x.x, x.y, x.z, w.rest_density * w.volume[id]);
}
/// What forces see of it beside its place: its velocity, and its volume.
DECANT_DEVICE float4 wall_velocity(const DevicePose& pose, Float3 x, float volume) {
  const Float3 v = surface_velocity(pose, x);
  return make_float4(v.x, v.y, v.z, volume);
}
/// Where forces see it.
DECANT_DEVICE void place_wall_for_force(const ParticleArrays& a, const Walls& w, int slot, Float3 x, int id,
                                        const DevicePose& pose) {
  a.force_position[a.base + slot] = make_float4(x.x, x.y, x.z, 0.0f);
  a.force_velocity[a.base + slot] = wall_velocity(pose, x, w.volume[id]);
}
DECANT_DEVICE void place_wall(const ParticleArrays& a, const Walls& w, int slot, Float3 x, int id,
                              const DevicePose& pose) {
  place_wall_for_density(a, w, slot, x, id);
  place_wall_for_force(a, w, slot, x, id, pose);
}

/// Wall particles to their place in the world: before the first substep, when the status says nothing yet; at the end
/// of the substep under way, for densities and forces; or in two halves, each beside a pass that does not read what it
/// writes: for densities beside the forces of the substep that ends, for forces beside the densities of the next one.
enum class WallsFor { start, both, density, force };
template <WallsFor what>
struct PlaceWalls {
  ParticleArrays a;
  Walls walls;
  int first;

  DECANT_DEVICE void operator()(int k) const {
    const int slot = first + k, id = walls.id[slot];
    if (id < 0) return;
    const DevicePose* poses = what == WallsFor::start   ? a.poses
                              : what == WallsFor::force ? a.poses_before()
                                                        : a.poses_after();
    const DevicePose& pose = poses[walls.container[slot]];
    const Float3 x = rotate(pose, xyz(walls.local[slot])) + pose.translation;
    if (a.reach && !a.reach->holds(x)) return leave_out(slot);
    if constexpr (what != WallsFor::force) place_wall_for_density(a, walls, slot, x, id);
    if constexpr (what != WallsFor::density) place_wall_for_force(a, walls, slot, x, id, pose);
  }

 private:
  /// Of a rank that has nothing near it: far from everything, which most are already and nobody writes twice.
  DECANT_DEVICE void leave_out(int slot) const {
    constexpr float far = 1e12f;
    for (float4* positions : {a.current.position, a.force_position})
      if (!(positions[a.base + slot].x >= far)) positions[a.base + slot] = make_float4(far, far, far, 0.0f);
  }
};
template <WallsFor what>
DECANT_KERNEL(256)
place_walls_kernel(int slots, PlaceWalls<what> place) {
  for_each_thread(slots, place);
}

/// Wall particles where their frame has them, to find their volumes.
struct PlaceWallsInBodyFrame {
  ParticleArrays a;
  Walls walls;
  DECANT_DEVICE void operator()(int slot) const {
    a.current.position[a.base + slot] = with_square(xyz(walls.local[slot]));
  }
};
DECANT_KERNEL(256) place_walls_in_body_frame_kernel(int slots, PlaceWallsInBodyFrame place) {
  for_each_thread(slots, place);
}

}  // namespace
}  // namespace decant::gpu
