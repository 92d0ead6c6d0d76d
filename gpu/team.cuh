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
#pragma unroll
    for (int step = lanes / 2; step > 0; step /= 2) value += __shfl_xor_sync(mask(), value, step);
    return value;
  }
  /// What lanes have written to shared memory is there for all.
  DECANT_DEVICE void sync() const { __syncwarp(mask()); }
#else
  static_assert(lanes == 1, "the host runs one lane a particle");
  int lane() const { return 0; }
  bool leads() const { return true; }
  template <class T>
  T sum(T value) const {
    return value;
  }
  void sync() const {}
#endif

 private:
#ifdef __CUDACC__
  /// The lanes of this group in its warp.
  DECANT_DEVICE static unsigned mask() {
    return ((1u << lanes) - 1u) << ((threadIdx.x % 32u) / lanes * lanes);
  }
#endif
  int i_;
};

#ifdef __CUDACC__
/// Shared memory of a block, as much as its launch gave it.
DECANT_DEVICE char* desk() {
  extern __shared__ int4 decant_desk[];
  return reinterpret_cast<char*>(decant_desk);
}
#endif

/// What a thread has to write, one int after the other, until there are whole words of four to send off:
/// in shared memory (at the beginning of the desk), since a thread's own cannot be indexed. Putting takes
/// two instructions.
class Outbox {
 public:
  static constexpr int room = 16;
  // A distance that keeps eight threads that access words out of each other's banks.
  static constexpr int stride = 4 * room + 16;
  DECANT_DEVICE Outbox() : at_(begin()) {}
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  /// There must be room: `relieve` in time.
  DECANT_DEVICE void put(bool does, int value) {
    if (!does) return;
    *reinterpret_cast<int*>(rooms() + at_) = value;
    at_ += 4;
  }
  DECANT_DEVICE int held() const { return (at_ - begin()) / 4; }
  /// send(int4) for every whole word, unless there is room for `more` and that goes for the threads that
  /// run beside this one: what all do at once costs as much as what one does.
  template <class Send>
  DECANT_DEVICE void relieve(int more, Send&& send) {
    const bool full = held() + more > room;
#ifdef __CUDACC__
    if (!__any_sync(__activemask(), full)) return;
#else
    if (!full) return;
#endif
    const int first = begin();
    int from = first;
#pragma unroll 1
    for (; at_ - from >= 16; from += 16) send(word(from));
    word(first) = word(from);
    at_ -= from - first;
  }

 private:
  DECANT_DEVICE int4& word(int at) { return *reinterpret_cast<int4*>(rooms() + at); }
#ifdef __CUDACC__
  DECANT_DEVICE static char* rooms() { return desk(); }
  DECANT_DEVICE static int begin() { return static_cast<int>(threadIdx.x) * stride; }
#else
  char* rooms() { return reinterpret_cast<char*>(all_); }
  static int begin() { return 0; }
  int4 all_[room / 4 + 1]{};
#endif
  int at_;  // bytes, so that an address is one sum
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
__global__ void __launch_bounds__(group_block, 7) group_kernel(int n, Body body) {
  Group<lanes> group(static_cast<int>(blockIdx.x) * (group_block / lanes) +
                     static_cast<int>(threadIdx.x) / lanes);
  if (group.particle(0) < n) body(group);
}

#endif

}  // namespace decant::gpu::DECANT_EXECUTOR
