/// \file
/// Several threads for one thing, in two forms. A TileTeam spans a block and reads all points tile by
/// tile through shared memory: for all pairs. A Group is 1, 2, 4 or 8 neighboring threads of a warp:
/// for lists and cells, where a few lanes a particle fill a chip that 50,000 threads do not.
///
/// Both hold particles: particle(k) for k < held, active(k) where it is one of its own, and
/// offer lane(), leads() and sum(). Nothing is written for a particle that is not active.
#pragma once

#include "gpu/exec.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

#ifdef __CUDACC__
/// Lanes of a TileTeam on this executor, and particles of one of its threads. A point read from shared
/// memory takes four cycles, the test of a pair one, so each point is tested with four particles.
inline constexpr int tile_lanes = 16, tile_held = 4;
/// Points of a tile: the longer it is, the fewer the waits for all threads to have read it.
inline constexpr int tile_points = 8 * tile_size;
/// Threads of a block of groups.
inline constexpr int group_block = 128;
#else
inline constexpr int tile_lanes = 1, tile_held = 1, tile_points = tile_size;
#endif

/// Every thread of a block runs the same calls, so a sweep or a sum may synchronise inside. Lanes
/// past the end shadow the last particle.
class TileTeam {
 public:
  static constexpr int held = tile_held;
#ifdef __CUDACC__
  static constexpr int side = tile_size / tile_lanes;  // threads a lane
  static constexpr int particles = side * held;        // a block
  __device__ TileTeam(float4* tile, int n) : tile_(tile), n_(n) {}
  DECANT_DEVICE int lane() const { return static_cast<int>(threadIdx.x) / side; }
  DECANT_DEVICE bool leads() const { return lane() == 0; }
  DECANT_DEVICE int particle(int k) const { return active(k) ? place(k) : n_ - 1; }
  DECANT_DEVICE bool active(int k) const { return place(k) < n_; }

  /// As many points from `first` on as a tile has, for all threads to read until the next call; beyond
  /// `end`, a multiple of tile_size away, NaN.
  DECANT_DEVICE const float4* tile(const float4* points, int first, int end) const {
    __syncthreads();
#pragma unroll
    for (int k = 0; k < tile_points; k += tile_size) {
      const int at = k + static_cast<int>(threadIdx.x);
      tile_[at] = first + k < end ? points[first + at] : make_float4(NAN, NAN, NAN, NAN);
    }
    __syncthreads();
    return tile_;
  }
  /// Sum over the team's lanes, in a fixed order, on every lane.
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
  DECANT_DEVICE int place(int k) const {
    return static_cast<int>(blockIdx.x) * particles + k * side +
           static_cast<int>(threadIdx.x) % side;
  }
  float4* tile_;
  int n_;
#else
  explicit TileTeam(int i) : i_(i) {}
  int lane() const { return 0; }
  bool leads() const { return true; }
  int particle(int) const { return i_; }
  bool active(int) const { return true; }
  const float4* tile(const float4* points, int first, int) const { return points + first; }
  template <class T>
  T sum(T value) const {
    return value;
  }

 private:
  int i_;
#endif
};

/// Threads side by side in a warp; groups go their own ways.
template <int lanes_>
class Group {
 public:
  static constexpr int lanes = lanes_, held = 1;
  DECANT_DEVICE explicit Group(int i) : i_(i) {}
  DECANT_DEVICE int particle(int) const { return i_; }
  DECANT_DEVICE bool active(int) const { return true; }
#ifdef __CUDACC__
  static_assert(lanes == 1 || lanes == 2 || lanes == 4 || lanes == 8);
  DECANT_DEVICE int lane() const { return static_cast<int>(threadIdx.x) % lanes; }
  DECANT_DEVICE bool leads() const { return lane() == 0; }
  template <class T>
  DECANT_DEVICE T sum(T value) const {
    // The lanes of this group in its warp.
    const unsigned mask = ((1u << lanes) - 1u) << ((threadIdx.x % 32u) / lanes * lanes);
#pragma unroll
    for (int step = lanes / 2; step > 0; step /= 2) value += __shfl_xor_sync(mask, value, step);
    return value;
  }
#else
  static_assert(lanes == 1, "the host runs one lane a particle");
  int lane() const { return 0; }
  bool leads() const { return true; }
  template <class T>
  T sum(T value) const {
    return value;
  }
#endif

 private:
  int i_;
};

#ifdef __CUDACC__

template <class Body>
__global__ void __launch_bounds__(256) particle_kernel(int n, Body body) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < n) body(i);
}

template <class Body>
__global__ void __launch_bounds__(tile_size) tile_kernel(int n, Body body) {
  __shared__ float4 tile[tile_points];
  TileTeam team(tile, n);
  body(team);
}

template <int lanes, class Body>
__global__ void __launch_bounds__(group_block) group_kernel(int n, Body body) {
  const auto thread = static_cast<long long>(blockIdx.x) * group_block + threadIdx.x;
  Group<lanes> group(static_cast<int>(thread / lanes));
  if (group.particle(0) < n) body(group);
}

#endif

}  // namespace decant::gpu::DECANT_EXECUTOR
