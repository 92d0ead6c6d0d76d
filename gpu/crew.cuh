/// \file
/// Many substeps in one launch. Between two launches that depend on each other a chip of 100,000 threads
/// stands still for two to three microseconds, and for four where the device decides what comes next;
/// threads that stay where they are wait for each other in little more than one. For sizes that do not
/// fill the chip, where that is most of a substep.
///
/// A crew is all threads of such a launch: one block a multiprocessor, all there at once. Each block has
/// a run of neighboring particles, so that what it reads stays in its cache.
#pragma once

#include "gpu/queue.cuh"

#ifdef __CUDACC__
#include <cooperative_groups.h>
#include <cub/block/block_scan.cuh>
#endif

namespace decant::gpu::DECANT_EXECUTOR {

#ifdef __CUDACC__

/// Threads of a block; as many as find room with 72 registers each.
inline constexpr int crew_block = 896;

class Crew {
 public:
  DECANT_DEVICE void sync() const { cooperative_groups::this_grid().sync(); }

  template <class Body>
  DECANT_DEVICE void run(const Each<Body>& step) const {
    share<1>(step.n, [&](int i) DECANT_INLINE { step.body(i); });
  }
  template <int lanes, class Body>
  DECANT_DEVICE void run(const EachGroup<lanes, Body>& step) const {
    share<lanes>(step.n, [&](int i) DECANT_INLINE {
      Group<lanes> group(i);
      step.body(group);
    });
  }
  template <class First, class Second>
  DECANT_DEVICE void run(const Beside<First, Second>& steps) const {
    run(steps.first);
    run(steps.second);
  }
  template <class First, class... Rest>
  DECANT_DEVICE void run(const InOrder<First, Rest...>& steps) const {
    run(steps.first);
    if constexpr (sizeof...(Rest) > 0) {
      sync();
      run(steps.rest);
    }
  }
  /// Each block sums a share, and then adds up those before its own.
  DECANT_DEVICE void run(const PrefixSum& step) const {
    using Scan = cub::BlockScan<int, crew_block>;
    __shared__ typename Scan::TempStorage room;
    const int blocks = static_cast<int>(gridDim.x), block = static_cast<int>(blockIdx.x);
    const int thread = static_cast<int>(threadIdx.x);
    // Numbers are taken by fours.
    const int fours = (step.n + 3) / 4, each = (fours + blocks - 1) / blocks;
    const int begin = each * block < fours ? each * block : fours;
    const int end = begin + each < fours ? begin + each : fours;
    const int4* in = reinterpret_cast<const int4*>(step.in);
    int4* out = reinterpret_cast<int4*>(step.out);
    const auto total = [&](int value) DECANT_INLINE {
      int before, all;
      Scan(room).ExclusiveSum(value, before, all);
      __syncthreads();
      return all;
    };
    int sum = 0;
    for (int k = begin + thread; k < end; k += crew_block) {
      const int4 v = in[k];
      sum += v.x + v.y + v.z + v.w;
    }
    sum = total(sum);
    if (thread == 0) step.shares[block] = sum;
    sync();
    sum = 0;
    for (int k = thread; k < block; k += crew_block) sum += step.shares[k];
    int before = total(sum);
    for (int first = begin; first < end; first += crew_block) {
      const int k = first + thread;
      const int4 v = k < end ? in[k] : make_int4(0, 0, 0, 0);
      int ahead, all;
      Scan(room).ExclusiveSum(v.x + v.y + v.z + v.w, ahead, all);
      __syncthreads();
      ahead += before;
      if (k < end) out[k] = make_int4(ahead, ahead + v.x, ahead + v.x + v.y, ahead + v.x + v.y + v.z);
      before += all;
    }
  }

 private:
  /// body(i) for i in 0 … n−1, with so many threads side by side for each.
  template <int lanes, class Body>
  DECANT_DEVICE void share(int n, Body&& body) const {
    constexpr int a_warp = 32 / lanes, warps = crew_block / 32;
    const int thread = static_cast<int>(threadIdx.x), runs = (n + a_warp - 1) / a_warp;
    const int blocks = static_cast<int>(gridDim.x), block = static_cast<int>(blockIdx.x);
    const int begin = first_of(runs, block, blocks), end = first_of(runs, block + 1, blocks);
#pragma unroll 1
    for (int run = begin + thread / 32; run < end; run += warps) {
      const int i = run * a_warp + thread % 32 / lanes;
      if (i < n) body(i);
    }
  }
  DECANT_DEVICE static int first_of(int runs, int block, int blocks) {
    return static_cast<int>(static_cast<long long>(runs) * block / blocks);
  }
};

/// Nanoseconds from one lap to the next, by one thread of all.
class CrewClock {
 public:
  DECANT_DEVICE explicit CrewClock(long long* stage_ns) : stage_ns_(stage_ns), last_(now()) {}
  DECANT_DEVICE void lap(int stage) {
    if (blockIdx.x != 0 || threadIdx.x != 0) return;
    const long long time = now();
    stage_ns_[stage] += time - last_;
    last_ = time;
  }

 private:
  DECANT_DEVICE static long long now() {
    long long ns;
    asm volatile("mov.u64 %0, %globaltimer;" : "=l"(ns));
    return ns;
  }
  long long *stage_ns_, last_;
};

template <class Substep>
__global__ void __launch_bounds__(crew_block, 1)
    substeps_kernel(int times, const __grid_constant__ Substep substep) {
  const Crew crew;
  CrewClock clock(substep.stage_ns);
#pragma unroll 1
  for (int k = 0; k < times; ++k) {
    if (atomic_load(substep.stale) != 0) {
      crew.run(substep.build);
      crew.sync();
      clock.lap(0);
    }
    crew.run(substep.density);
    crew.sync();
    clock.lap(1);
    crew.run(substep.move);
    crew.sync();
    clock.lap(2);
  }
}

/// Blocks of a crew that runs the kernel with so many bytes of shared memory a block: one on each
/// multiprocessor, as many as a sum has shares for; or 0 where there is no room for that.
template <class Kernel>
int crew_blocks(Kernel kernel, std::size_t desk) {
  int device = 0, blocks = 0, cooperates = 0, most_shared = 0, resident = 0;
  CUDA_CHECK(cudaGetDevice(&device));
  CUDA_CHECK(cudaDeviceGetAttribute(&blocks, cudaDevAttrMultiProcessorCount, device));
  CUDA_CHECK(cudaDeviceGetAttribute(&cooperates, cudaDevAttrCooperativeLaunch, device));
  CUDA_CHECK(cudaDeviceGetAttribute(&most_shared, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
  cudaFuncAttributes attributes{};
  CUDA_CHECK(cudaFuncGetAttributes(&attributes, kernel));
  if (!cooperates || desk + attributes.sharedSizeBytes > static_cast<std::size_t>(most_shared)) return 0;
  CUDA_CHECK(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                  static_cast<int>(desk)));
  CUDA_CHECK(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, kernel, crew_block, desk));
  return resident < 1 ? 0 : std::min(blocks, PrefixSum::most_shares);
}

/// Runs the substep so many times in one launch. Whether the device can: if it has no room for a block on
/// each of its multiprocessors, nothing is done.
template <class Build, class Density, class Move>
bool repeat(Queue& queue, int times, const Substep<Build, Density, Move>& substep) {
  const auto kernel = substeps_kernel<Substep<Build, Density, Move>>;
  const std::size_t desk = std::max({desk_bytes(substep.build, crew_block),
                                     desk_bytes(substep.density, crew_block),
                                     desk_bytes(substep.move, crew_block)});
  const int blocks = queue.remembered(reinterpret_cast<const void*>(kernel),
                                      [&] { return crew_blocks(kernel, desk); });
  if (blocks == 0) return false;
  cudaLaunchAttribute together{};
  together.id = cudaLaunchAttributeCooperative;
  together.val.cooperative = 1;
  cudaLaunchConfig_t launch{};
  launch.gridDim = static_cast<unsigned>(blocks);
  launch.blockDim = crew_block;
  launch.dynamicSmemBytes = desk;
  launch.stream = queue.stream();
  launch.attrs = &together;
  launch.numAttrs = 1;
  CUDA_CHECK(cudaLaunchKernelEx(&launch, kernel, times, substep));
  return true;
}

#else

template <class Build, class Density, class Move>
bool repeat(Queue& queue, int times, const Substep<Build, Density, Move>& substep) {
  using Clock = std::chrono::steady_clock;
  auto last = Clock::now();
  const auto lap = [&](int stage) {
    const auto now = Clock::now();
    substep.stage_ns[stage] +=
        std::chrono::duration_cast<std::chrono::nanoseconds>(now - last).count();
    last = now;
  };
  for (int k = 0; k < times; ++k) {
    if (*substep.stale != 0) {
      start(queue, substep.build);
      lap(0);
    }
    start(queue, substep.density);
    lap(1);
    start(queue, substep.move);
    lap(2);
  }
  return true;
}

#endif

}  // namespace decant::gpu::DECANT_EXECUTOR
