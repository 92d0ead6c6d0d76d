#include "gpu/core/algorithms.hpp"

#include <thrust/binary_search.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/scan.h>
#include <thrust/sort.h>
#include <thrust/system/omp/execution_policy.h>

namespace decant::gpu::host {

void exclusive_scan(const int* in, int* out, int n) { thrust::exclusive_scan(thrust::omp::par, in, in + n, out); }

void sort_by_key(int* keys, int* values, int n) {
  thrust::stable_sort_by_key(thrust::omp::par, keys, keys + n, values);
}

void sort_pairs(Pairs& pairs, int n, int) { sort_by_key(pairs.key, pairs.value, n); }

void lower_bounds(const int* keys, int n, int* out, int count) {
  thrust::lower_bound(thrust::omp::par, keys, keys + n, thrust::counting_iterator<int>(0),
                      thrust::counting_iterator<int>(count), out);
}

}  // namespace decant::gpu::host
