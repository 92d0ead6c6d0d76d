/// \file
/// One kernel for many substeps. Between two launches that depend on each other a chip of 100,000 threads
/// stands still for two to three microseconds, and for four where the device decides what comes next;
/// threads that stay where they are wait for each other in little more than one. For sizes that do not
/// fill the chip, where that is most of a substep.
///
/// A persistent grid has one block per multiprocessor, all there at once. Each block has a run of neighboring
/// particles, so that what it reads stays in its cache. On the host it is one thread that starts OpenMP's.
///
/// A PersistentBlock is one of its blocks with its own memory, which lasts as long as the kernel: shared memory, on the
/// host a part of what BlockMemory names. Whatever it does is done in a call of `for_each_block`, on the host for one
/// block after the other.
#pragma once

#include "gpu/core/staging_buffer.cuh"
#include "gpu/core/stream.cuh"

#include <algorithm>

#ifdef __CUDACC__
#include <cooperative_groups.h>
#include <cub/block/block_scan.cuh>
#define DECANT_GRID_CONSTANT __grid_constant__
#else
#include <chrono>
#define DECANT_GRID_CONSTANT
#endif

namespace decant::gpu {
namespace {

/// Threads per block; as many as find room with 72 registers each.
inline constexpr int persistent_block = 896;

/// Memory of blocks, `bytes` each; on the device it is shared memory, and `all` null.
struct BlockMemory {
  char* all;
  int blocks, bytes;
};

#ifdef __CUDACC__

class PersistentBlock {
 public:
  DECANT_DEVICE int number() const { return static_cast<int>(blockIdx.x); }
  DECANT_DEVICE char* memory() const { return shared_memory(); }
  /// What its threads have written is there for all of them.
  DECANT_DEVICE void sync() const { __syncthreads(); }
  /// body(k) for k in 0 … n−1, by neighboring threads for neighboring k.
  template <class Body>
  DECANT_DEVICE void for_each(int n, const Body& body) const {
#pragma unroll 1
    for (int k = static_cast<int>(threadIdx.x); k < n; k += persistent_block) body(k);
  }
  /// store(k, load(k)) for k in 0 … n−1; a thread's next `ahead` loads are under way together.
  template <int ahead, class Load, class Store>
  DECANT_DEVICE void copy(int n, const Load& load, const Store& store) const {
#pragma unroll 1
    for (int k = static_cast<int>(threadIdx.x); k < n; k += ahead * persistent_block) {
      decltype(load(k)) values[ahead];
#pragma unroll
      for (int b = 0; b < ahead; ++b) {
        const int at = k + b * persistent_block;
        values[b] = load(at < n ? at : k);
      }
#pragma unroll
      for (int b = 0; b < ahead; ++b) {
        const int at = k + b * persistent_block;
        if (at < n) store(at, values[b]);
      }
    }
  }
  template <class Body>
  DECANT_DEVICE void once(const Body& body) const {
    if (threadIdx.x == 0) body();
  }
  /// store(k, value(0) + … + value(k−1)) for k in 0 … n−1; the sum of all, on every thread, after a sync.
  template <class Value, class Store>
  DECANT_DEVICE int exclusive_scan(int n, const Value& value, const Store& store) const {
    using Scan = cub::BlockScan<int, persistent_block>;
    __shared__ typename Scan::TempStorage memory;
    const int each = (n + persistent_block - 1) / persistent_block, begin = each * static_cast<int>(threadIdx.x);
    const int end = begin + each < n ? begin + each : n;
    int sum = 0, before, all;
    for (int k = begin; k < end; ++k) sum += value(k);
    Scan(memory).ExclusiveSum(sum, before, all);
    for (int k = begin; k < end; ++k) {
      store(k, before);
      before += value(k);
    }
    sync();
    return all;
  }
};

class PersistentGrid {
 public:
  DECANT_DEVICE void sync() const { cooperative_groups::this_grid().sync(); }

  /// By one thread, of those that work is least likely to have reached.
  template <class Body>
  DECANT_DEVICE void once(const Body& body) const {
    if (blockIdx.x + 1 == gridDim.x && threadIdx.x + 1 == blockDim.x) body();
  }
  /// body(i) for i in 0 … n−1.
  template <class Body>
  DECANT_DEVICE void for_each(int n, const Body& body) const {
    share<1>(n, [&](int i) DECANT_INLINE { body(i); });
  }
  /// body(team) with a SubWarp<lanes> for each of n particles.
  template <int lanes, class Body>
  DECANT_DEVICE void for_each_team(int n, const Body& body) const {
    share<lanes>(n, [&](int i) DECANT_INLINE {
      SubWarp<lanes> team(i);
      body(team);
    });
  }
  /// body(block) by all threads of each block.
  template <class Body>
  DECANT_DEVICE void for_each_block(const BlockMemory&, const Body& body) const {
    body(PersistentBlock());
  }
  /// out[k] = in[0] + … + in[k−1], k < n; both have room for whole fours. Each block sums a share, and then adds
  /// up those before its own: block_sums[blocks].
  DECANT_DEVICE void exclusive_scan(const int* from, int* to, int n, int* block_sums) const {
    using Scan = cub::BlockScan<int, persistent_block>;
    __shared__ typename Scan::TempStorage memory;
    const int blocks = static_cast<int>(gridDim.x), block = static_cast<int>(blockIdx.x);
    const int thread = static_cast<int>(threadIdx.x);
    const int fours = (n + 3) / 4, each = (fours + blocks - 1) / blocks;
    const int begin = each * block < fours ? each * block : fours;
    const int end = begin + each < fours ? begin + each : fours;
    const int4* in = reinterpret_cast<const int4*>(from);
    int4* out = reinterpret_cast<int4*>(to);
    const auto total = [&](int value) DECANT_INLINE {
      int before, all;
      Scan(memory).ExclusiveSum(value, before, all);
      __syncthreads();
      return all;
    };
    int sum = 0;
    for (int k = begin + thread; k < end; k += persistent_block) {
      const int4 v = in[k];
      sum += v.x + v.y + v.z + v.w;
    }
    sum = total(sum);
    if (thread == 0) block_sums[block] = sum;
    sync();
    sum = 0;
    for (int k = thread; k < block; k += persistent_block) sum += block_sums[k];
    int before = total(sum);
    for (int first = begin; first < end; first += persistent_block) {
      const int k = first + thread;
      const int4 v = k < end ? in[k] : make_int4(0, 0, 0, 0);
      int ahead, all;
      Scan(memory).ExclusiveSum(v.x + v.y + v.z + v.w, ahead, all);
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
    constexpr int per_warp = 32 / lanes, warps = persistent_block / 32;
    const int thread = static_cast<int>(threadIdx.x), runs = (n + per_warp - 1) / per_warp;
    const int blocks = static_cast<int>(gridDim.x), block = static_cast<int>(blockIdx.x);
    const int begin = first_of(runs, block, blocks), end = first_of(runs, block + 1, blocks);
#pragma unroll 1
    for (int run = begin + thread / 32; run < end; run += warps) {
      const int i = run * per_warp + thread % 32 / lanes;
      if (i < n) body(i);
    }
  }
  DECANT_DEVICE static int first_of(int runs, int block, int blocks) {
    return static_cast<int>(static_cast<long long>(runs) * block / blocks);
  }
};

/// Nanoseconds from one lap to the next, by one thread of all; `store` adds up what laps took.
class PersistentTimer {
 public:
  DECANT_DEVICE PersistentTimer() : last_(now()) {
    if (counts())
      for (int k = 0; k < 3; ++k) sum(k) = 0;
  }
  DECANT_DEVICE void lap(int stage) {
    if (!counts()) return;
    const long long time = now();
    sum(stage) += time - last_;
    last_ = time;
  }
  DECANT_DEVICE void store(long long* stage_ns) const {
    if (!counts()) return;
    for (int k = 0; k < 3; ++k) stage_ns[k] += sum(k);
  }

 private:
  DECANT_DEVICE static bool counts() { return blockIdx.x == 0 && threadIdx.x == 0; }
  DECANT_DEVICE static long long& sum(int stage) {
    __shared__ long long sums[3];  // a load and store of global memory would take a thread all others wait for longer
    return sums[stage];
  }
  DECANT_DEVICE static long long now() {
    long long ns;
    asm volatile("mov.u64 %0, %globaltimer;" : "=l"(ns));
    return ns;
  }
  long long last_;
};

/// Blocks of a persistent grid on this device, at most.
inline int most_blocks() {
  int device = 0, blocks = 0;
  CUDA_CHECK(cudaGetDevice(&device));
  CUDA_CHECK(cudaDeviceGetAttribute(&blocks, cudaDevAttrMultiProcessorCount, device));
  return std::min(blocks, most_persistent_blocks);
}

/// Bytes of dynamic shared memory that a block of the kernel may have.
template <class Kernel>
std::size_t most_shared_bytes(Kernel kernel) {
  int device = 0, most = 0;
  CUDA_CHECK(cudaGetDevice(&device));
  CUDA_CHECK(cudaDeviceGetAttribute(&most, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
  cudaFuncAttributes attributes{};
  CUDA_CHECK(cudaFuncGetAttributes(&attributes, kernel));
  return static_cast<std::size_t>(most) - attributes.sharedSizeBytes;
}

/// Blocks of a persistent grid that runs the kernel with so many bytes of shared memory per block, or 0 where
/// there is no room for one on each multiprocessor.
template <class Kernel>
int persistent_blocks(Kernel kernel, std::size_t shared_bytes) {
  int device = 0, cooperates = 0, resident = 0;
  CUDA_CHECK(cudaGetDevice(&device));
  CUDA_CHECK(cudaDeviceGetAttribute(&cooperates, cudaDevAttrCooperativeLaunch, device));
  if (!cooperates || shared_bytes > most_shared_bytes(kernel)) return 0;
  CUDA_CHECK(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(shared_bytes)));
  CUDA_CHECK(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, kernel, persistent_block, shared_bytes));
  return resident < 1 ? 0 : most_blocks();
}

/// kernel(times, argument) by a persistent grid of so many blocks.
template <class Argument>
void launch_persistent(Stream& stream, void (*kernel)(int, Argument), int blocks, std::size_t shared_bytes, int times,
                       const Argument& argument) {
  cudaLaunchAttribute together{};
  together.id = cudaLaunchAttributeCooperative;
  together.val.cooperative = 1;
  cudaLaunchConfig_t launch{};
  launch.gridDim = static_cast<unsigned>(blocks);
  launch.blockDim = persistent_block;
  launch.dynamicSmemBytes = shared_bytes;
  launch.stream = stream.handle();
  launch.attrs = &together;
  launch.numAttrs = 1;
  CUDA_CHECK(cudaLaunchKernelEx(&launch, kernel, times, argument));
}

#else

class PersistentBlock {
 public:
  PersistentBlock(int number, char* memory) : number_(number), memory_(memory) {}
  int number() const { return number_; }
  char* memory() const { return memory_; }
  void sync() const {}
  template <class Body>
  void for_each(int n, const Body& body) const {
    for (int k = 0; k < n; ++k) body(k);
  }
  template <int, class Load, class Store>
  void copy(int n, const Load& load, const Store& store) const {
    for (int k = 0; k < n; ++k) store(k, load(k));
  }
  template <class Body>
  void once(const Body& body) const {
    body();
  }
  template <class Value, class Store>
  int exclusive_scan(int n, const Value& value, const Store& store) const {
    int before = 0;
    for (int k = 0; k < n; ++k) {
      const int here = value(k);
      store(k, before);
      before += here;
    }
    return before;
  }

 private:
  int number_;
  char* memory_;
};

class PersistentGrid {
 public:
  template <class Body>
  void for_each_block(const BlockMemory& m, const Body& body) const {
    for_each_thread(m.blocks, [&](int b) {
      body(PersistentBlock(b, m.all + static_cast<std::size_t>(b) * static_cast<std::size_t>(m.bytes)));
    });
  }
  void sync() const {}
  template <class Body>
  void once(const Body& body) const {
    body();
  }
  template <class Body>
  void for_each(int n, const Body& body) const {
    for_each_thread(n, body);
  }
  template <int lanes, class Body>
  void for_each_team(int n, const Body& body) const {
    gpu::for_each_team<SubWarp<lanes> >(n, body);
  }
  void exclusive_scan(const int* in, int* out, int n, int*) const { host::exclusive_scan(in, out, n); }
};

class PersistentTimer {
 public:
  void lap(int stage) {
    const auto now = Clock::now();
    sum_[stage] += std::chrono::duration_cast<std::chrono::nanoseconds>(now - last_).count();
    last_ = now;
  }
  void store(long long* stage_ns) const {
    for (int k = 0; k < 3; ++k) stage_ns[k] += sum_[k];
  }

 private:
  using Clock = std::chrono::steady_clock;
  long long sum_[3] = {0, 0, 0};
  Clock::time_point last_ = Clock::now();
};

/// As if it were a device, of few and small multiprocessors.
inline int most_blocks() { return most_persistent_blocks; }
template <class Kernel>
std::size_t most_shared_bytes(Kernel) {
  return 227u << 10;
}
template <class Kernel>
int persistent_blocks(Kernel, std::size_t) {
  return 1;
}
template <class Argument>
void launch_persistent(Stream&, void (*kernel)(int, Argument), int, std::size_t, int times, const Argument& argument) {
  kernel(times, argument);
}

#endif

}  // namespace
}  // namespace decant::gpu
