#include "gpu/core/algorithms.hpp"
#include "gpu/core/cuda_check.hpp"

#include <thrust/binary_search.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/sort.h>
#include <thrust/system/cuda/execution_policy.h>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

namespace decant::gpu::cuda {

void exclusive_scan(const int* in, int* out, int n, void* scratch, std::size_t bytes, void* stream) {
  CUDA_CHECK(cub::DeviceScan::ExclusiveSum(scratch, bytes, in, out, n, static_cast<cudaStream_t>(stream)));
}

std::size_t scan_bytes(int n) {
  std::size_t bytes = 0;
  CUDA_CHECK(
      cub::DeviceScan::ExclusiveSum(nullptr, bytes, static_cast<const int*>(nullptr), static_cast<int*>(nullptr), n));
  return bytes;
}

void sort_by_key(int* keys, int* values, int n, void* stream) {
  thrust::stable_sort_by_key(thrust::cuda::par.on(static_cast<cudaStream_t>(stream)), keys, keys + n, values);
}

void sort_pairs(Pairs& pairs, int n, int bits, void* scratch, std::size_t bytes, void* stream) {
  cub::DoubleBuffer<int> keys(pairs.key, pairs.other_key), values(pairs.value, pairs.other_value);
  CUDA_CHECK(
      cub::DeviceRadixSort::SortPairs(scratch, bytes, keys, values, n, 0, bits, static_cast<cudaStream_t>(stream)));
  pairs = {keys.Current(), keys.Alternate(), values.Current(), values.Alternate()};
}

std::size_t sort_bytes(int n, int bits) {
  std::size_t bytes = 0;
  cub::DoubleBuffer<int> none(nullptr, nullptr);
  CUDA_CHECK(cub::DeviceRadixSort::SortPairs(nullptr, bytes, none, none, n, 0, bits));
  return bytes;
}

void lower_bounds(const int* keys, int n, int* out, int count, void* stream) {
  thrust::lower_bound(thrust::cuda::par.on(static_cast<cudaStream_t>(stream)), keys, keys + n,
                      thrust::counting_iterator<int>(0), thrust::counting_iterator<int>(count), out);
}

}  // namespace decant::gpu::cuda
