/// \file
/// Which threads work on a particle, in two forms. A TileTeam spans a block and reads all positions tile by
/// tile through shared memory: for all pairs. A SubWarp is 1, 2, 4 or 8 neighboring threads of a warp: for
/// lists and cells, where a few threads per particle fill a chip that 50,000 threads do not.
///
/// Both have particles_per_thread, particle(k) for k below that, and active(k), whether particle(k) is one of
/// its own: nothing is stored for others; lane(), the thread's number among those of a particle, is_leader()
/// and sum() over these threads. `block_size` and `blocks_per_multiprocessor` are what kernels are compiled for.
#pragma once

#include "gpu/core/particle_arrays.cuh"

#include <type_traits>

#ifndef __CUDACC__
#include <thrust/for_each.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/system/omp/execution_policy.h>
#endif

namespace decant::gpu {
namespace {

#ifdef __CUDACC__
/// Threads per particle of a TileTeam on this executor, and particles per thread. A position read from shared
/// memory takes four cycles, the test of a pair one, so each position is tested with four particles.
inline constexpr int tile_lanes = 16, tile_particles_per_thread = 4;
/// Positions of a tile: the longer it is, the fewer the waits for all threads to have read it.
inline constexpr int tile_positions = 8 * tile_size;
#else
/// A position is tested with several particles side by side in vectors.
inline constexpr int tile_lanes = 1, tile_particles_per_thread = 16, tile_positions = tile_size;
#endif

/// Every thread of a block runs the same calls, so a sweep or a sum may synchronise inside. Threads past the
/// end shadow the last particle.
class TileTeam {
 public:
  static constexpr int particles_per_thread = tile_particles_per_thread;
  static constexpr int block_size = tile_size, blocks_per_multiprocessor = 1;
#ifdef __CUDACC__
  static constexpr int side = tile_size / tile_lanes;  // threads of one lane number
  static constexpr int particles_per_block = side * particles_per_thread;
  __device__ TileTeam(float4* tile, int n) : tile_(tile), n_(n) {}
  DECANT_DEVICE int lane() const { return static_cast<int>(threadIdx.x) / side; }
  DECANT_DEVICE bool is_leader() const { return lane() == 0; }
  DECANT_DEVICE int particle(int k) const { return active(k) ? slot(k) : n_ - 1; }
  DECANT_DEVICE bool active(int k) const { return slot(k) < n_; }

  /// As many positions from `first` on as a tile has, for all threads to read until the next call; beyond
  /// `end`, a multiple of tile_size away, NaN.
  DECANT_DEVICE const float4* tile(const float4* positions, int first, int end) const {
    __syncthreads();
#pragma unroll
    for (int k = 0; k < tile_positions; k += tile_size) {
      const int at = k + static_cast<int>(threadIdx.x);
      tile_[at] = first + k < end ? positions[first + at] : make_float4(NAN, NAN, NAN, NAN);
    }
    __syncthreads();
    return tile_;
  }
  /// Sum over the threads of a particle, in a fixed order, on each of them.
  template <class T>
  DECANT_DEVICE T sum(T value) const {
    static_assert(sizeof(T) <= sizeof(float4));
    T* part = reinterpret_cast<T*>(tile_);
    __syncthreads();
    part[threadIdx.x] = value;
    __syncthreads();
    T total = part[threadIdx.x % side];
    for (int l = 1; l < tile_lanes; ++l) total += part[l * side + threadIdx.x % side];
    return total;
  }

 private:
  DECANT_DEVICE int slot(int k) const {
    return static_cast<int>(blockIdx.x) * particles_per_block + k * side + static_cast<int>(threadIdx.x) % side;
  }
  float4* tile_;
  int n_;
#else
  static constexpr int particles_per_block = particles_per_thread;
  TileTeam(int team, int n) : first_(team * particles_per_block), n_(n) {}
  int lane() const { return 0; }
  bool is_leader() const { return true; }
  int particle(int k) const { return active(k) ? first_ + k : n_ - 1; }
  bool active(int k) const { return first_ + k < n_; }
  const float4* tile(const float4* positions, int first, int) const { return positions + first; }
  template <class T>
  T sum(T value) const {
    return value;
  }

 private:
  int first_, n_;
#endif
};

/// Threads side by side in a warp, all with the same particle. Sub-warps of a warp need not agree on anything.
template <int lanes_>
class SubWarp {
 public:
  static constexpr int lanes = lanes_, particles_per_thread = 1;
  static constexpr int block_size = 128, blocks_per_multiprocessor = 7;
  static constexpr int particles_per_block = block_size / lanes;
  DECANT_DEVICE explicit SubWarp(int i) : i_(i) {}
  DECANT_DEVICE int particle(int) const { return i_; }
  DECANT_DEVICE bool active(int) const { return true; }
#ifdef __CUDACC__
  static_assert(lanes == 1 || lanes == 2 || lanes == 4 || lanes == 8);
  DECANT_DEVICE int lane() const { return static_cast<int>(threadIdx.x) % lanes; }
  DECANT_DEVICE bool is_leader() const { return lane() == 0; }
  template <class T>
  DECANT_DEVICE T sum(T value) const {
#pragma unroll
    for (int step = lanes / 2; step > 0; step /= 2) value += __shfl_xor_sync(mask(), value, step);
    return value;
  }
  /// What its threads have written to shared memory is there for all of them.
  DECANT_DEVICE void sync() const { __syncwarp(mask()); }
  /// The least value of all threads, and its number, of several the lowest; on each of them.
  DECANT_DEVICE void find_least(float& value, int& number) const {
#pragma unroll
    for (int step = 1; step < lanes; step *= 2) {
      const float other = __shfl_xor_sync(mask(), value, step);
      const int other_number = __shfl_xor_sync(mask(), number, step);
      if (other < value || (other == value && other_number < number)) {
        value = other;
        number = other_number;
      }
    }
  }
#else
  static_assert(lanes == 1, "the host runs one thread per particle");
  int lane() const { return 0; }
  bool is_leader() const { return true; }
  template <class T>
  T sum(T value) const {
    return value;
  }
  void sync() const {}
  void find_least(float&, int&) const {}
#endif

 private:
#ifdef __CUDACC__
  /// The lanes of this sub-warp in its warp.
  DECANT_DEVICE static unsigned mask() { return ((1u << lanes) - 1u) << ((threadIdx.x % 32u) / lanes * lanes); }
#endif
  int i_;
};

/// By one thread of a kernel.
template <class Body>
DECANT_DEVICE void once(const Body& body) {
#ifdef __CUDACC__
  if (blockIdx.x == 0 && threadIdx.x == 0) body();
#else
  body();
#endif
}

/// Bodies of kernels: body(i) by the thread of i, for i in 0 … n−1 …
template <class Body>
DECANT_DEVICE void for_each_thread(int n, Body&& body) {
#ifdef __CUDACC__
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < n) body(i);
#else
  thrust::for_each(thrust::omp::par, thrust::counting_iterator<int>(0), thrust::counting_iterator<int>(n),
                   [&body](int i) { body(i); });
#endif
}
/// … and body(team) by the threads of each particle, of n.
template <class Team, class Body>
DECANT_DEVICE void for_each_team(int n, const Body& body) {
#ifdef __CUDACC__
  if constexpr (std::is_same_v<Team, TileTeam>) {
    __shared__ float4 tile[tile_positions];
    TileTeam team(tile, n);
    body(team);
  } else {
    Team team(static_cast<int>(blockIdx.x) * Team::particles_per_block + static_cast<int>(threadIdx.x) / Team::lanes);
    if (team.particle(0) < n) body(team);
  }
#else
  if constexpr (std::is_same_v<Team, TileTeam>) {
    constexpr int each = TileTeam::particles_per_block;
    for_each_thread((n + each - 1) / each, [&body, n](int i) {
      TileTeam team(i, n);
      body(team);
    });
  } else {
    for_each_thread(n, [&body](int i) {
      Team team(i);
      body(team);
    });
  }
#endif
}

/// body() once, by the last block that gets here: it sees what all have written before.
/// \param blocks_ended  0 before and after
template <class Body>
DECANT_DEVICE void by_last_block([[maybe_unused]] int* blocks_ended, Body&& body) {
#ifdef __CUDACC__
  __threadfence();
  __syncthreads();
  if (threadIdx.x != 0 || atomicAdd(blocks_ended, 1) != static_cast<int>(gridDim.x) - 1) return;
  *blocks_ended = 0;
  __threadfence();
#endif
  body();
}

/// Blocks of a persistent grid, at most: a scan has a sum for each.
inline constexpr int most_persistent_blocks = 1024;

/// Calls with SubWarp<lanes>, or with fewer lanes where kernels are compiled for `most` only; the host has those of
/// one thread.
template <int most = 8, class Call>
void with_sub_warps([[maybe_unused]] int lanes, Call call) {
#ifdef __CUDACC__
  if constexpr (most >= 8)
    if (lanes >= 8) return call(std::type_identity<SubWarp<8>>());
  if constexpr (most >= 4)
    if (lanes >= 4) return call(std::type_identity<SubWarp<4>>());
  if (lanes >= 2) return call(std::type_identity<SubWarp<2>>());
#endif
  call(std::type_identity<SubWarp<1>>());
}

}  // namespace
}  // namespace decant::gpu
