/// \file
/// All substeps of an advance with neighbor lists in tiles (tiles.cuh), in one persistent kernel. Where a kernel of its
/// own would end, the grid waits; what runs between two waits neither reads nor writes what runs beside it.
#pragma once

#include "gpu/kernels/make_tile.cuh"
#include "gpu/kernels/persistent_sort.cuh"
#include "gpu/kernels/tiles.cuh"

namespace decant::gpu {
namespace {

/// What a substep consists of.
struct TileSubstep {
  int n, moving_walls;
  DeviceStatus* status;
  PlaceWalls<WallsFor::density> place_walls;
  FluidSource source;
  // Once an advance particles are sorted by …
  PersistentSort<FluidSource> sort;
  TileOrder order_of_tiles;
  int rows;
  OrderByIdInCell<TiledFluidSource> order;
  // … then tiles are made, and used by
  UseTile tiles;
  Integrate<CheckDisplacement<false>> integrate;
};

/// Who owns what. Particles are in `source.into` then, and where lists will have them is known.
DECANT_DEVICE void sort_into_tiles(const PersistentGrid& grid, const TileSubstep& s) {
  s.sort(grid);
  grid.for_each(s.rows, [&](int k) DECANT_INLINE { s.order_of_tiles.count_in(k); });
  grid.sync();
  grid.exclusive_scan(s.order_of_tiles.count, s.order_of_tiles.start, s.rows, s.sort.block_sums);
  grid.sync();
  grid.for_each(s.n, s.order);
  grid.sync();
  grid.for_each(s.n, [&](int i) DECANT_INLINE {
    s.tiles.a.state.position[i] = s.source.into.position[i];
    s.tiles.a.state.velocity[i] = s.source.into.velocity[i];
  });
}

DECANT_KERNEL(persistent_block, 1)
persistent_tiles_kernel(int substeps, const DECANT_GRID_CONSTANT TileSubstep s) {
  constexpr int lanes = TileSet::lanes;
  const PersistentGrid grid;
  PersistentTimer timer;
#pragma unroll 1
  for (int k = 0; k < substeps; ++k) {
    const int rebuild = atomic_load(&s.status->rebuild_needed);
    const auto load_state = [&] {
      grid.for_each_block(s.tiles.memory, [&](const PersistentBlock& block)
                                              DECANT_INLINE { s.tiles.load_state(block, s.tiles.of(block)); });
    };
    if (k > 0) load_state();  // while it is not known yet whether that will serve
    if (rebuild != 0) {
      grid.for_each(s.moving_walls, s.place_walls);
      if (k == 0) {
        sort_into_tiles(grid, s);
      } else {
        grid.for_each(s.n, [&](int i) DECANT_INLINE { s.source.store_origin(i, 0, s.source.position(i)); });
      }
      grid.sync();
      if (k > 0) grid.once([&] { s.source.begin(); });
      grid.for_each_block(s.tiles.memory,
                          [&](const PersistentBlock& block) DECANT_INLINE { MakeTile{s.tiles}(block); });
      load_state();
      timer.lap(0);
    }
    grid.once(BeginSubstep{s.tiles.a, true});
    grid.for_each_block(s.tiles.memory, [&](const PersistentBlock& block) DECANT_INLINE {
      const TileMemory tile = s.tiles.of(block);
      block.for_each(tile.threads, [&](int t) DECANT_INLINE {
        const int owned = t / lanes, local = tile.own[owned];
        SubWarp<lanes> team(local);
        Density<TileNeighbors, StoreDensityTerms>{
            s.tiles.c, s.tiles.local_arrays(tile), {{s.tiles.c}, tile, owned}, {s.tiles.terms, tile.index[local]}}(
            team);
      });
    });
    grid.sync();
    timer.lap(1);
    grid.for_each_block(s.tiles.memory, [&](const PersistentBlock& block) DECANT_INLINE {
      using Then = IntegrateOwned<Integrate<CheckDisplacement<false>>>;
      const TileMemory tile = s.tiles.of(block);
      s.tiles.load_terms(block, tile);
      block.for_each(tile.threads, [&](int t) DECANT_INLINE {
        const int owned = t / lanes, local = tile.own[owned];
        SubWarp<lanes> team(local);
        Force<TileNeighbors, Then>{
            s.tiles.c, s.tiles.local_arrays(tile), {{s.tiles.c}, tile, owned}, {s.integrate, tile, owned}}(team);
      });
    });
    grid.sync();
    timer.lap(2);
  }
  // What asks for neighbors next finds lists, and the walls where densities see them.
  grid.for_each_block(s.tiles.memory, [&](const PersistentBlock& block)
                                          DECANT_INLINE { s.tiles.store_lists(block, s.tiles.of(block)); });
  grid.for_each(s.moving_walls, s.place_walls);
  timer.store(s.status->stage_ns);
}

}  // namespace
}  // namespace decant::gpu
