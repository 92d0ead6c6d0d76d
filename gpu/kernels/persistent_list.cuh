/// \file
/// All substeps of an advance with neighbor lists, in one persistent kernel. Where a kernel of its own would end,
/// the grid waits; what runs between two waits neither reads nor writes what runs beside it.
#pragma once

#include "gpu/kernels/build_list.cuh"
#include "gpu/kernels/density.cuh"
#include "gpu/kernels/force.cuh"
#include "gpu/kernels/persistent_sort.cuh"
#include "gpu/kernels/sort_sources.cuh"

namespace decant::gpu {
namespace {

/// What a substep consists of.
template <bool periodic>
struct ListSubstep {
  using Neighbors = ListNeighbors<periodic>;

  int n, moving_walls;
  DeviceStatus* status;
  // Lists are rebuilt by …
  PersistentSort<FluidSource> sort;
  OrderByIdInCell<FluidSource> order;
  BuildList<periodic> build;
  // … and used by
  Density<Neighbors> density;
  PlaceWalls<WallsFor::force> walls_for_force;
  Force<Neighbors, Integrate<CheckDisplacement<periodic>>> force_and_integrate;
  PlaceWalls<WallsFor::density> walls_for_density;
};

template <int lanes, bool periodic>
DECANT_KERNEL(persistent_block, 1)
persistent_list_kernel(int substeps, const DECANT_GRID_CONSTANT ListSubstep<periodic> s) {
  const PersistentGrid grid;
  PersistentTimer timer;
#pragma unroll 1
  for (int k = 0; k < substeps; ++k) {
    if (atomic_load(&s.status->rebuild_needed) != 0) {
      s.sort(grid);
      grid.sync();
      grid.for_each(s.n, s.order);
      grid.sync();
      grid.template for_each_team<lanes>(s.n, s.build);
      grid.sync();
      timer.lap(0);
    }
    grid.once(BeginSubstep{s.density.a, true});
    grid.template for_each_team<lanes>(s.n, s.density);
    grid.for_each(s.moving_walls, s.walls_for_force);
    grid.sync();
    timer.lap(1);
    grid.template for_each_team<lanes>(s.n, s.force_and_integrate);
    grid.for_each(s.moving_walls, s.walls_for_density);
    grid.sync();
    timer.lap(2);
  }
  timer.store(s.status->stage_ns);
}

}  // namespace
}  // namespace decant::gpu
