/// \file
/// The steps of a counting sort (cell_sort.cuh) by a persistent grid, before things are ordered within their cells.
#pragma once

#include "gpu/core/persistent.cuh"
#include "gpu/kernels/cell_sort.cuh"

namespace decant::gpu {
namespace {

template <class Source>
struct PersistentSort {
  int n;
  CountInCells<Source> count;
  const int* cell_counts;
  int* cell_starts;
  int cells;
  int* block_sums;
  ScatterIntoCells<Source> scatter;

  /// When the grid waits next, each thing has a place in its cell, and where cells begin is known already.
  DECANT_DEVICE void operator()(const PersistentGrid& grid) const {
    grid.for_each(n, count);
    grid.sync();
    grid.exclusive_scan(cell_counts, cell_starts, cells, block_sums);
    grid.sync();
    grid.for_each(n, scatter);
  }
};

}  // namespace
}  // namespace decant::gpu
