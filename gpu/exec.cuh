/// \file
/// One source, two executors. Compiled by nvcc this is CUDA; compiled by g++ it is Thrust's OpenMP
/// device system. Backends use only this, the teams of team.cuh and the queue of queue.cuh: here are
/// vector types, device memory and atomics.
#pragma once

#include "oracle/backend.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#ifdef __CUDACC__
#include <cuda_runtime.h>

#include "gpu/cuda_check.hpp"
#define DECANT_EXECUTOR cuda
#define DECANT_DEVICE __device__ __forceinline__
#define DECANT_BOTH __host__ __device__ __forceinline__
#define DECANT_INLINE __attribute__((always_inline))  // of lambdas: called, their captures are in memory
#else
#include <math.h>

#include <atomic>
#define DECANT_EXECUTOR host
#define DECANT_DEVICE inline
#define DECANT_BOTH inline
#define DECANT_INLINE
#endif

namespace decant::gpu::DECANT_EXECUTOR {

#ifndef __CUDACC__
struct alignas(16) float4 {
  float x, y, z, w;
};
struct alignas(8) int2 {
  int x, y;
};
struct alignas(16) int4 {
  int x, y, z, w;
};
inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }
inline int2 make_int2(int x, int y) { return {x, y}; }
inline int4 make_int4(int x, int y, int z, int w) { return {x, y, z, w}; }
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

DECANT_DEVICE int bits_in(unsigned mask) {
#ifdef __CUDACC__
  return __popc(mask);
#else
  return __builtin_popcount(mask);
#endif
}
/// Number of the lowest bit set; mask is not 0.
DECANT_DEVICE int lowest_bit(unsigned mask) {
#ifdef __CUDACC__
  return __ffs(static_cast<int>(mask)) - 1;
#else
  return __builtin_ctz(mask);
#endif
}

/// Particles of a team's tile; arrays that tiles are cut from are padded to a multiple of it.
inline constexpr int tile_size = 256;

DECANT_BOTH int padded(int n) { return (n + tile_size - 1) / tile_size * tile_size; }

#ifdef __CUDACC__
/// The calling thread's own, so that backends on several threads wait for nobody else's work. Whoever
/// hands a backend to another thread does so between its calls, at whose end all is done.
inline const cudaStream_t own_stream = cudaStreamPerThread;
#endif

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
  /// From element `first` on, where there is room.
  void upload_at(std::size_t first, const std::vector<T>& from) {
    copy_in(data_ + first, from.data(), from.size() * sizeof(T));
  }
  std::vector<T> download(std::size_t n) const {
    std::vector<T> to(n);
    copy_out(to.data(), data_, n * sizeof(T));
    return to;
  }
  /// From an address inside.
  void download_bytes(void* to, const void* from, std::size_t bytes) const {
    copy_out(to, from, bytes);
  }
  T* get() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

 private:
#ifdef __CUDACC__
  static void* allocate(std::size_t bytes) {
    void* p = nullptr;
    CUDA_CHECK(cudaMallocAsync(&p, bytes, own_stream));
    return p;
  }
  static void fill_ones(void* p, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemsetAsync(p, 0xFF, bytes, own_stream));
  }
  /// From pageable memory, which has been read when the call returns.
  static void copy_in(void* to, const void* from, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, own_stream));
  }
  static void copy_out(void* to, const void* from, std::size_t bytes) {
    if (bytes == 0) return;
    CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, own_stream));
    CUDA_CHECK(cudaStreamSynchronize(own_stream));
  }
  void release() {
    if (data_) cudaFreeAsync(data_, own_stream);  // a destructor has nobody to report to
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

#ifdef __CUDACC__

DECANT_DEVICE void atomic_minimum(unsigned long long* to, unsigned long long value) {
  atomicMin(to, value);
}
DECANT_DEVICE void atomic_minimum(int* to, int value) { atomicMin(to, value); }
DECANT_DEVICE void atomic_maximum(int* to, int value) { atomicMax(to, value); }
/// Adds 1; returns what was there.
DECANT_DEVICE int atomic_increment(int* to) { return atomicAdd(to, 1); }
/// Two's complement adds alike with and without sign.
DECANT_DEVICE void atomic_add(long long* to, int value) {
  atomicAdd(reinterpret_cast<unsigned long long*>(to),
            static_cast<unsigned long long>(static_cast<long long>(value)));
}
/// What another thread may be changing.
DECANT_DEVICE int atomic_load(const int* from) { return *static_cast<const volatile int*>(from); }

#else

template <class T>
void atomic_minimum(T* to, T value) {
  std::atomic_ref<T> at(*to);
  auto seen = at.load();
  while (value < seen && !at.compare_exchange_weak(seen, value)) {
  }
}
inline void atomic_maximum(int* to, int value) {
  std::atomic_ref<int> at(*to);
  auto seen = at.load();
  while (value > seen && !at.compare_exchange_weak(seen, value)) {
  }
}
inline int atomic_increment(int* to) { return std::atomic_ref<int>(*to).fetch_add(1); }
inline void atomic_add(long long* to, int value) {
  std::atomic_ref<long long>(*to).fetch_add(value, std::memory_order_relaxed);
}
inline int atomic_load(const int* from) {
  return std::atomic_ref<int>(*const_cast<int*>(from)).load(std::memory_order_relaxed);
}

#endif

}  // namespace decant::gpu::DECANT_EXECUTOR
