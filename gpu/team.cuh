/// \file
/// Several lanes for one particle, in two forms. A TileTeam spans a block and reads all points tile by
/// tile through shared memory: for all pairs. A Group is 1, 2, 4 or 8 neighboring threads of a warp:
/// for cells and lists, where a few lanes a particle fill a chip that 50,000 threads do not.
/// Both offer lane(), leads() and sum(); a body gets (team, i, active) and writes nothing unless active.
#pragma once

#include "gpu/exec.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

#ifdef __CUDACC__
/// Lanes of a TileTeam on this executor.
inline constexpr int tile_lanes = 4;
/// Threads of a block of groups.
inline constexpr int group_block = 128;
#else
inline constexpr int tile_lanes = 1;
#endif

/// A lane is a whole warp wide: the threads of a warp serve neighboring particles and read the same
/// point of a tile at once. Every thread of a block runs the same calls, so a sweep or a sum may
/// synchronise inside.
template <int lanes>
class TileTeam {
 public:
#ifdef __CUDACC__
  static constexpr int particles = tile_size / lanes;  // a block
  static_assert(particles % 32 == 0, "a warp must not be split between lanes");
  __device__ TileTeam(float4* tile) : tile_(tile) {}
  DECANT_DEVICE int lane() const { return static_cast<int>(threadIdx.x) / particles; }
  DECANT_DEVICE bool leads() const { return lane() == 0; }

  /// visit(first, tile) for one tile of points [begin, end) after the other, whole tiles.
  template <class Visit>
  DECANT_DEVICE void tiles(const float4* points, int begin, int end, Visit&& visit) {
    for (int first = begin; first < end; first += tile_size) {
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
  void tiles(const float4* points, int begin, int end, Visit&& visit) {
    for (int first = begin; first < end; first += tile_size) visit(first, points + first);
  }
  template <class T>
  T sum(T value) const {
    return value;
  }
#endif
};

/// Threads side by side in a warp; groups go their own ways.
template <int lanes_>
class Group {
 public:
  static constexpr int lanes = lanes_;
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
};

#ifdef __CUDACC__

template <class Body>
__global__ void __launch_bounds__(256) particle_kernel(int n, Body body) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < n) body(i);
}

template <int lanes, class Body>
__global__ void __launch_bounds__(tile_size) tile_kernel(int n, Body body) {
  __shared__ float4 tile[tile_size];
  TileTeam<lanes> team(tile);
  const int i = static_cast<int>(blockIdx.x) * TileTeam<lanes>::particles +
                static_cast<int>(threadIdx.x) % TileTeam<lanes>::particles;
  // Lanes past the end shadow the last particle: they must meet every barrier.
  body(team, i < n ? i : n - 1, i < n);
}

template <int lanes, class Body>
__global__ void __launch_bounds__(group_block) group_kernel(int n, Body body) {
  const auto thread = static_cast<long long>(blockIdx.x) * group_block + threadIdx.x;
  const int i = static_cast<int>(thread / lanes);
  Group<lanes> group;
  if (i < n) body(group, i, true);
}

#endif

}  // namespace decant::gpu::DECANT_EXECUTOR
