/// \file
/// One source, two executors. Compiled by nvcc this is CUDA; compiled by g++ it is Thrust's OpenMP
/// device system. Backends use only what is here: buffers, a functor per particle, a functor per
/// particle with a team of lanes, an atomic minimum, a stopwatch.
#pragma once

#include "oracle/backend.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#ifdef __CUDACC__
#include <cuda_runtime.h>

#include "gpu/cuda_check.hpp"
#define DECANT_EXECUTOR cuda
#define DECANT_DEVICE __device__ __forceinline__
#else
#include <math.h>

#include <thrust/for_each.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/system/omp/execution_policy.h>

#include <atomic>
#include <chrono>
#define DECANT_EXECUTOR host
#define DECANT_DEVICE inline
#endif

namespace decant::gpu::DECANT_EXECUTOR {

#ifndef __CUDACC__
struct alignas(16) float4 {
  float x, y, z, w;
};
struct alignas(8) float2 {
  float x, y;
};
inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }
inline float2 make_float2(float x, float y) { return {x, y}; }
using ::fabsf;
using ::fmaxf;
using ::fminf;
using ::rintf;
using ::sqrtf;
using ::floorf;
#endif

/// The smaller one; NaN loses. Each compiler gets the form that it turns into one instruction.
DECANT_DEVICE float lesser(float a, float b) {
#ifdef __CUDACC__
  return fminf(a, b);
#else
  return a < b ? a : b;
#endif
}

/// Particles of a team's tile; arrays that tiles are cut from are padded to a multiple of it.
inline constexpr int tile_size = 256;

inline int padded(int n) { return (n + tile_size - 1) / tile_size * tile_size; }

/// Device memory of n elements, freed with the object.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(std::size_t n) { resize(n); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() { release(); }

  /// New contents are undefined; every byte is set to 0xFF, which reads as NaN or −1.
  void resize(std::size_t n) {
    if (n != size_) {
      release();
      if (n > 0) data_ = static_cast<T*>(allocate(n * sizeof(T)));
      size_ = n;
    }
    fill_ones(data_, size_ * sizeof(T));
  }
  void upload(const std::vector<T>& from) {
    if (size_ < from.size()) resize(from.size());
    copy_in(data_, from.data(), from.size() * sizeof(T));
  }
  std::vector<T> download(std::size_t n) const {
    std::vector<T> to(n);
    copy_out(to.data(), data_, n * sizeof(T));
    return to;
  }
  T* get() const { return data_; }
  std::size_t size() const { return size_; }

 private:
#ifdef __CUDACC__
  static void* allocate(std::size_t bytes) {
    void* p = nullptr;
    CUDA_CHECK(cudaMalloc(&p, bytes));
    return p;
  }
  static void fill_ones(void* p, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemset(p, 0xFF, bytes));
  }
  static void copy_in(void* to, const void* from, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemcpy(to, from, bytes, cudaMemcpyHostToDevice));
  }
  static void copy_out(void* to, const void* from, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemcpy(to, from, bytes, cudaMemcpyDeviceToHost));
  }
  void release() {
    cudaFree(data_);  // a destructor has nobody to report to
    data_ = nullptr;
    size_ = 0;
  }
#else
  static void* allocate(std::size_t bytes) {
    return ::operator new(bytes, std::align_val_t(64));
  }
  static void fill_ones(void* p, std::size_t bytes) {
    if (bytes) std::memset(p, 0xFF, bytes);
  }
  static void copy_in(void* to, const void* from, std::size_t bytes) {
    if (bytes) std::memcpy(to, from, bytes);
  }
  static void copy_out(void* to, const void* from, std::size_t bytes) {
    if (bytes) std::memcpy(to, from, bytes);
  }
  void release() {
    ::operator delete(data_, std::align_val_t(64));
    data_ = nullptr;
    size_ = 0;
  }
#endif
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Lanes that work on one particle together. A lane is a whole warp wide: the threads of a warp serve
/// neighboring particles and read the same point of a tile at once. Every thread of a block runs the
/// same calls, so a query or a sum may synchronise inside them.
template <int lanes>
class Team {
 public:
#ifdef __CUDACC__
  static constexpr int particles = tile_size / lanes;  // a block
  static_assert(particles % 32 == 0, "a warp must not be split between lanes");
  __device__ Team(float4* tile) : tile_(tile) {}
  DECANT_DEVICE int lane() const { return static_cast<int>(threadIdx.x) / particles; }
  DECANT_DEVICE bool leads() const { return lane() == 0; }

  /// visit(first, tile) for one tile of `points` after the other; `count` is a multiple of tile_size.
  template <class Visit>
  DECANT_DEVICE void tiles(const float4* points, int count, Visit&& visit) {
    for (int first = 0; first < count; first += tile_size) {
      __syncthreads();
      tile_[threadIdx.x] = points[first + static_cast<int>(threadIdx.x)];
      __syncthreads();
      visit(first, tile_);
    }
  }
  /// Sum over the team's lanes, in a fixed order, on every lane.
  template <class T>
  DECANT_DEVICE T sum(T value) const {
    static_assert(sizeof(T) <= sizeof(float4));
    T* part = reinterpret_cast<T*>(tile_);
    __syncthreads();
    part[threadIdx.x] = value;
    __syncthreads();
    T total = part[threadIdx.x % particles];
    for (int l = 1; l < lanes; ++l) total += part[l * particles + threadIdx.x % particles];
    return total;
  }

 private:
  float4* tile_;
#else
  static_assert(lanes == 1, "the host runs one lane a particle");
  int lane() const { return 0; }
  bool leads() const { return true; }
  template <class Visit>
  void tiles(const float4* points, int count, Visit&& visit) {
    for (int first = 0; first < count; first += tile_size) visit(first, points + first);
  }
  template <class T>
  T sum(T value) const {
    return value;
  }
#endif
};

#ifdef __CUDACC__

inline constexpr int team_lanes = 4;

template <class Body>
__global__ void particle_kernel(int n, Body body) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < n) body(i);
}

template <int lanes, class Body>
__global__ void __launch_bounds__(tile_size) team_kernel(int n, Body body) {
  __shared__ float4 tile[tile_size];
  Team<lanes> team(tile);
  const int i = static_cast<int>(blockIdx.x) * Team<lanes>::particles +
                static_cast<int>(threadIdx.x) % Team<lanes>::particles;
  // Lanes past the end shadow the last particle: they must meet every barrier.
  body(team, i < n ? i : n - 1, i < n);
}

/// body(i) for i in 0 … n−1.
template <class Body>
void for_each(int n, Body body) {
  if (n <= 0) return;
  particle_kernel<<<(n + 255) / 256, 256>>>(n, body);
  CUDA_CHECK(cudaGetLastError());
}

/// body(team, i, active); where not active, nothing may be written.
template <class Body>
void for_each_team(int n, Body body) {
  if (n <= 0) return;
  constexpr int particles = Team<team_lanes>::particles;
  team_kernel<team_lanes><<<(n + particles - 1) / particles, tile_size>>>(n, body);
  CUDA_CHECK(cudaGetLastError());
}

DECANT_DEVICE void atomic_minimum(unsigned long long* to, unsigned long long value) {
  atomicMin(to, value);
}

/// Seconds between laps on the device, by events, since `start`, which may come again and again;
/// `read` waits for the device and adds up.
class Stopwatch {
 public:
  ~Stopwatch() {
    for (auto e : events_) cudaEventDestroy(e);
  }
  void start() {
    if (used_ > 0) laps_.push_back(nullptr);
    record();
  }
  void lap(StageTimes::Stage& stage) {
    laps_.push_back(&stage);
    record();
  }
  void read() {
    if (used_ == 0) return;
    CUDA_CHECK(cudaEventSynchronize(events_[used_ - 1]));
    for (std::size_t k = 0; k < laps_.size(); ++k) {
      if (!laps_[k]) continue;
      float milliseconds = 0;
      CUDA_CHECK(cudaEventElapsedTime(&milliseconds, events_[k], events_[k + 1]));
      laps_[k]->seconds += 1e-3 * milliseconds;
      ++laps_[k]->calls;
    }
    laps_.clear();
    used_ = 0;
  }

 private:
  void record() {
    if (used_ == events_.size()) {
      events_.emplace_back();
      CUDA_CHECK(cudaEventCreate(&events_.back()));
    }
    CUDA_CHECK(cudaEventRecord(events_[used_++]));
  }
  std::vector<cudaEvent_t> events_;
  std::vector<StageTimes::Stage*> laps_;
  std::size_t used_ = 0;
};

#else

inline constexpr int team_lanes = 1;

/// body(i) for i in 0 … n−1.
template <class Body>
void for_each(int n, Body body) {
  if (n <= 0) return;
  thrust::for_each(thrust::omp::par, thrust::counting_iterator<int>(0),
                   thrust::counting_iterator<int>(n), body);
}

/// body(team, i, active).
template <class Body>
void for_each_team(int n, Body body) {
  for_each(n, [body](int i) {
    Team<1> team;
    body(team, i, true);
  });
}

inline void atomic_minimum(unsigned long long* to, unsigned long long value) {
  std::atomic_ref<unsigned long long> at(*to);
  auto seen = at.load();
  while (value < seen && !at.compare_exchange_weak(seen, value)) {
  }
}

/// Seconds between laps, by the wall clock.
class Stopwatch {
 public:
  void start() { last_ = std::chrono::steady_clock::now(); }
  void lap(StageTimes::Stage& stage) {
    const auto now = std::chrono::steady_clock::now();
    stage.seconds += std::chrono::duration<double>(now - last_).count();
    ++stage.calls;
    last_ = now;
  }
  void read() {}

 private:
  std::chrono::steady_clock::time_point last_;
};

#endif

inline constexpr int lanes = team_lanes;

}  // namespace decant::gpu::DECANT_EXECUTOR
