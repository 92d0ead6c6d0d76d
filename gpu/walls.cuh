/// \file
/// Wall particles. In passes they are particles like any other, with a place in the world; moving
/// ones are placed anew at the end of every substep. They are looked up in their container's own frame,
/// where they never move: the grid of the moving source is built once, like that of the receiver.
#pragma once

#include "gpu/arrays.cuh"
#include "gpu/cells.cuh"
#include "gpu/contact.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// One container's wall particles, slots [begin, end); begin is a multiple of tile_size.
struct WallSegment {
  int begin, end;
  CellTable table;
  Float3 low, high;  // no wall particle is within reach of a point outside, in the frame of lookups
  // By bucket, for a grid that is never rebuilt: which wall particles may be within reach of the cell,
  // near[near_start[bucket]] on. Null: to be looked up row by row.
  const int *near_start, *near;
  bool in_world;  // looked up in the world, not in the container's frame

  DECANT_DEVICE bool out_of_reach(Float3 x) const {
    return x.x < low.x || x.x > high.x || x.y < low.y || x.y > high.y || x.z < low.z ||
           x.z > high.z;
  }
};

/// Slots of all containers, each padded to whole tiles; an id of −1 is padding.
struct Walls {
  float4* local;           // container frame
  int* id;
  const int* container;
  float* volume;           // V_b by id
  float rest_density;
};

/// Where densities see a wall particle.
DECANT_DEVICE void place_wall_for_density(const Arrays& a, const Walls& w, int slot, Float3 x, int id) {
  a.now.position[a.base + slot] =
      a.square ? point_at(x) : make_float4(x.x, x.y, x.z, w.rest_density * w.volume[id]);
}
/// Where forces see it.
DECANT_DEVICE void place_wall_for_force(const Arrays& a, const Walls& w, int slot, Float3 x, int id,
                                        const DevicePose& pose) {
  const Float3 v = cross(pose.omega, x - pose.pivot) + pose.surface;
  a.point[a.base + slot] = make_float4(x.x, x.y, x.z, 0.0f);
  a.motion[a.base + slot] = make_float4(v.x, v.y, v.z, w.volume[id]);
}
DECANT_DEVICE void place_wall(const Arrays& a, const Walls& w, int slot, Float3 x, int id,
                              const DevicePose& pose) {
  place_wall_for_density(a, w, slot, x, id);
  place_wall_for_force(a, w, slot, x, id, pose);
}

/// Wall particles to their place in the world: for densities and forces, at the end of the substep under
/// way or before the first; or in two halves, each beside a pass that does not read what it writes: for
/// densities beside the forces of the substep that ends, for forces beside the densities of the next one.
enum class PlacedFor { both, density, force };
template <PlacedFor what>
struct PlaceWallsPass {
  Arrays a;
  Walls walls;
  int first;

  DECANT_DEVICE void operator()(int k) const {
    const int slot = first + k, id = walls.id[slot];
    if (id < 0) return;
    const DevicePose* poses = what == PlacedFor::force ? a.poses_before() : a.poses_after();
    const DevicePose& pose = poses[walls.container[slot]];
    const Float3 x = rotate(pose, xyz(walls.local[slot])) + pose.translation;
    if constexpr (what != PlacedFor::force) place_wall_for_density(a, walls, slot, x, id);
    if constexpr (what != PlacedFor::density) place_wall_for_force(a, walls, slot, x, id, pose);
  }
};
using PosePass = PlaceWallsPass<PlacedFor::both>;

/// Wall particles where their frame has them, to find their volumes.
struct UnposedPass {
  Arrays a;
  Walls walls;
  DECANT_DEVICE void operator()(int slot) const {
    a.now.position[a.base + slot] = point_at(xyz(walls.local[slot]));
  }
};

/// V_b = 1 / Σ_k W_bk over the wall particles of the same container, itself included, by id.
template <class Query>
struct VolumePass {
  Constants c;
  Arrays a;
  Query query;
  Walls walls;
  int container, begin;  // its first slot

  template <class Team>
  DECANT_DEVICE void operator()(Team& team) const {
    Float3 x[Team::held];
    float sum[Team::held];
#pragma unroll
    for (int k = 0; k < Team::held; ++k) {
      x[k] = xyz(a.now.position[a.base + begin + team.particle(k)]);
      sum[k] = 0.0f;
    }
    with_kernel(c, [&](auto kernel) DECANT_INLINE {
      query.of_segment(team, container, x, a.now.position, [&](int k, float r2) DECANT_INLINE {
        sum[k] += kernel.w(c, radius(r2));
      });
    });
#pragma unroll
    for (int k = 0; k < Team::held; ++k) {
      const float total = team.sum(sum[k]);
      if (team.active(k) && team.leads())
        walls.volume[walls.id[begin + team.particle(k)]] = 1.0f / total;
    }
  }
};

/// Counts, and then fills, WallSegment::near.
template <bool periodic>
struct NearPass {
  CellTable table;
  int base, begin;   // index and slot of the segment's first wall particle
  const float4* local;
  int used[3];       // cells an axis that hold the segment; 0: its ends meet in the table
  float reach2;
  int* count;        // null: fill
  const int* start;
  int* near;

  DECANT_DEVICE void operator()(int bucket) const {
    int found = 0;
    for (int d = 0; d < 9 && table.in_table(bucket); ++d) {
      CellTable::Range r = table.row<periodic>(bucket, d);
      for (int part = 0; part < 2; ++part) {
        for (int b = r.begin; b < r.end; ++b) {
          if (used[0] > 0 &&
              !(table.distance2(bucket, used, xyz(local[begin + b])) < 1.0001f * reach2))
            continue;
          if (!count) near[start[bucket] + found] = base + b;
          ++found;
        }
        r = {r.begin2, r.end2, 0, 0};
      }
    }
    if (count) count[bucket] = found;
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
