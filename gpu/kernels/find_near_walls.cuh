/// \file
/// For walls that never move in the frame where they are looked up: by cell, which wall particles may be within
/// reach of it.
#pragma once

#include "gpu/kernels/place_walls.cuh"

namespace decant::gpu {
namespace {

/// Counts, and then fills, WallSegment::near.
template <bool periodic>
struct FindNearWalls {
  CellTable table;
  int base, begin;  // index and slot of the segment's first wall particle
  const float4* local;
  int used[3];  // cells an axis that hold the segment; 0: its ends meet in the table
  float reach2;
  int* count;  // null: fill
  const int* start;
  int* near;

  DECANT_DEVICE void operator()(int bucket) const {
    int found = 0;
    for (int d = 0; d < 9 && table.in_table(bucket); ++d) {
      CellTable::Range r = table.row<periodic>(bucket, d);
      for (int part = 0; part < 2; ++part) {
        for (int b = r.begin; b < r.end; ++b) {
          if (used[0] > 0 && !(table.distance2(bucket, used, xyz(local[begin + b])) < 1.0001f * reach2)) continue;
          if (!count) near[start[bucket] + found] = base + b;
          ++found;
        }
        r = {r.begin2, r.end2, 0, 0};
      }
    }
    if (count) count[bucket] = found;
  }
};
template <bool periodic>
DECANT_KERNEL(256)
find_near_walls_kernel(int buckets, FindNearWalls<periodic> find) {
  for_each_thread(buckets, find);
}

}  // namespace
}  // namespace decant::gpu
