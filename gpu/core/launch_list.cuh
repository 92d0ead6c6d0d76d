/// \file
/// Launches of kernels that have not run yet, and the graph of them; and a scan that is one kernel, since a library's
/// launches cannot be listed.
#pragma once

#include "gpu/core/buffer.cuh"

#ifdef __CUDACC__
#include <cub/block/block_scan.cuh>
#endif

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

namespace decant::gpu {
namespace {

#ifdef __CUDACC__

struct LaunchList {
  struct Launch {
    const void* kernel;
    unsigned blocks, threads;
    std::size_t shared_bytes;
    std::vector<std::vector<char>> arguments;  // as new aligns them
  };

  bool whole = true;  // what was launched is all here
  std::vector<Launch> launches;

  template <class... Parameters, class... Arguments>
  void add(void (*kernel)(Parameters...), int blocks, int threads, std::size_t shared_bytes,
           const Arguments&... arguments) {
    static_assert(((std::is_trivially_copyable_v<Parameters> && alignof(Parameters) <= 16) && ...));
    Launch launch{reinterpret_cast<const void*>(kernel),
                  static_cast<unsigned>(blocks),
                  static_cast<unsigned>(threads),
                  shared_bytes,
                  {}};
    const auto keep = [&]<class Parameter>(const Parameter& value) {
      std::vector<char>& bytes = launch.arguments.emplace_back(sizeof value);
      std::memcpy(bytes.data(), &value, sizeof value);
    };
    (keep(static_cast<Parameters>(arguments)), ...);
    launches.push_back(std::move(launch));
  }

  std::vector<const void*> kernels() const {
    std::vector<const void*> all;
    for (const Launch& launch : launches) all.push_back(launch.kernel);
    return all;
  }
  /// One after the other. Whoever gets it destroys it.
  cudaGraph_t graph() {
    cudaGraph_t graph = nullptr;
    CUDA_CHECK(cudaGraphCreate(&graph, 0));
    cudaGraphNode_t last = nullptr;
    for (Launch& launch : launches) {
      std::vector<void*> arguments;
      for (auto& argument : launch.arguments) arguments.push_back(argument.data());
      cudaKernelNodeParams parameters{};
      parameters.func = const_cast<void*>(launch.kernel);
      parameters.gridDim = dim3(launch.blocks);
      parameters.blockDim = dim3(launch.threads);
      parameters.sharedMemBytes = static_cast<unsigned>(launch.shared_bytes);
      parameters.kernelParams = arguments.data();
      cudaGraphNode_t node = nullptr;
      const cudaError_t error = cudaGraphAddKernelNode(&node, graph, last ? &last : nullptr, last ? 1 : 0, &parameters);
      if (error != cudaSuccess) cudaGraphDestroy(graph);
      CUDA_CHECK(error);
      last = node;
    }
    return graph;
  }
};

// Beyond so many numbers a block alone takes longer than a whole device's scan.
inline constexpr int scan_threads = 1024, scan_each = 4, most_scanned_by_a_block = 2 * scan_threads * scan_each;

/// out[k] = in[0] + … + in[k − 1] for `count` numbers, by one block.
DECANT_KERNEL(scan_threads) scan_kernel(int, int count, const int* in, int* out) {
  using Scan = cub::BlockScan<int, scan_threads>;
  __shared__ typename Scan::TempStorage storage;
  int before = 0;
  for (int tile = 0; tile < count; tile += scan_threads * scan_each) {
    const int first = tile + static_cast<int>(threadIdx.x) * scan_each;
    int values[scan_each], sum;
    for (int k = 0; k < scan_each; ++k) values[k] = first + k < count ? in[first + k] : 0;
    Scan(storage).ExclusiveSum(values, values, sum);
    for (int k = 0; k < scan_each; ++k)
      if (first + k < count) out[first + k] = before + values[k];
    before += sum;
    __syncthreads();
  }
}

#endif

}  // namespace
}  // namespace decant::gpu
