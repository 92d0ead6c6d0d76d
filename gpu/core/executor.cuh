/// \file
/// One source, two executors. Compiled by nvcc this is CUDA; compiled by g++ it is Thrust's OpenMP device
/// system. Here are the vector types and atomics of both, and what functions are declared with.
///
/// A backend is one translation unit for each executor, and all that it includes from core/, physics/ and
/// kernels/ is its own: hence the unnamed namespaces. What others call is in a header of its own.
#pragma once

#include "oracle/backend.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>

#ifdef __CUDACC__
#include <cuda_runtime.h>

#define DECANT_EXECUTOR cuda  // namespace of what a translation unit defines for others
#define DECANT_DEVICE __device__ __forceinline__
#define DECANT_BOTH __host__ __device__ __forceinline__
// A kernel, of so many threads per block at most, and as many blocks per multiprocessor at least. On the
// host it is a function that does the work of all threads.
#define DECANT_KERNEL(...) __global__ void __launch_bounds__(__VA_ARGS__)
#define DECANT_INLINE __attribute__((always_inline))  // of lambdas: called, their captures are in memory
#else
#include <math.h>

#include <atomic>
#define DECANT_EXECUTOR host
#define DECANT_DEVICE inline
#define DECANT_BOTH inline
#define DECANT_KERNEL(...) inline void
#define DECANT_INLINE
#endif

namespace decant::gpu {
namespace {

#ifndef __CUDACC__
struct alignas(16) float4 {
  float x, y, z, w;
};
struct alignas(8) float2 {
  float x, y;
};
struct alignas(8) int2 {
  int x, y;
};
struct alignas(8) uint2 {
  unsigned x, y;
};
struct alignas(16) int4 {
  int x, y, z, w;
};
inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }
inline float2 make_float2(float x, float y) { return {x, y}; }
inline int2 make_int2(int x, int y) { return {x, y}; }
inline int4 make_int4(int x, int y, int z, int w) { return {x, y, z, w}; }
using ::fabsf;
using ::floorf;
using ::fmaxf;
using ::fminf;
using ::rintf;
using ::sqrtf;
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

#ifdef __CUDACC__

DECANT_DEVICE void atomic_minimum(unsigned long long* to, unsigned long long value) { atomicMin(to, value); }
DECANT_DEVICE void atomic_minimum(int* to, int value) { atomicMin(to, value); }
DECANT_DEVICE void atomic_maximum(int* to, int value) { atomicMax(to, value); }
DECANT_DEVICE void atomic_or(unsigned* to, unsigned value) { atomicOr(to, value); }
/// Adds 1; returns what was there.
DECANT_DEVICE int atomic_increment(int* to) { return atomicAdd(to, 1); }
/// Two's complement adds alike with and without sign.
DECANT_DEVICE void atomic_add(long long* to, int value) {
  atomicAdd(reinterpret_cast<unsigned long long*>(to), static_cast<unsigned long long>(static_cast<long long>(value)));
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
inline void atomic_or(unsigned* to, unsigned value) { std::atomic_ref<unsigned>(*to).fetch_or(value); }
inline int atomic_increment(int* to) { return std::atomic_ref<int>(*to).fetch_add(1); }
inline void atomic_add(long long* to, int value) {
  std::atomic_ref<long long>(*to).fetch_add(value, std::memory_order_relaxed);
}
inline int atomic_load(const int* from) {
  return std::atomic_ref<int>(*const_cast<int*>(from)).load(std::memory_order_relaxed);
}

#endif

/// Floats as integers in the same order, for atomics.
DECANT_BOTH int ordered(float f) {
  int bits;
  memcpy(&bits, &f, sizeof bits);
  return bits >= 0 ? bits : bits ^ 0x7FFFFFFF;
}
DECANT_BOTH float unordered(int i) {
  const int bits = i >= 0 ? i : i ^ 0x7FFFFFFF;
  float f;
  memcpy(&f, &bits, sizeof f);
  return f;
}
/// The larger of a value and what is there, as ordered() has it; looking first saves most atomics.
DECANT_DEVICE void raise_to(int* largest, float value) {
  const int bits = ordered(value);
  if (bits > atomic_load(largest)) atomic_maximum(largest, bits);
}

}  // namespace
}  // namespace decant::gpu
