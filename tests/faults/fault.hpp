/// \file
/// Which planted fault is on, asked from host and device code of an altered copy of gpu/. Zero: none.
/// plant.py puts the questions in; nothing else includes this.
#pragma once

#include <cmath>
#include <cstring>
#ifdef __CUDACC__
#include <vector>
#endif

namespace decant::gpu {

inline int fault_on_host = 0;

#ifdef __CUDACC__
static __constant__ int fault_on_device = 0;
#define FAULT_BOTH __host__ __device__ __forceinline__

namespace cuda {
/// Of every file with kernels, what sets the number in its own constant memory.
inline std::vector<void (*)(int)>& fault_choosers() {
  static std::vector<void (*)(int)> all;
  return all;
}
}  // namespace cuda
#else
#define FAULT_BOTH inline
#endif

FAULT_BOTH bool fault(int number) {
#ifdef __CUDA_ARCH__
  return fault_on_device == number;
#else
  return fault_on_host == number;
#endif
}

/// x to so many significant bits, to nearest.
FAULT_BOTH float rounded_to(int bits, float x) {
  unsigned pattern;
  memcpy(&pattern, &x, sizeof pattern);
  const unsigned drop = 24u - static_cast<unsigned>(bits);
  pattern = (pattern + (1u << (drop - 1))) & ~((1u << drop) - 1u);
  memcpy(&x, &pattern, sizeof x);
  return x;
}

/// Mutations: the value, or another one when the fault is on.
FAULT_BOTH float altered(int number, float value, float instead) { return fault(number) ? instead : value; }

/// a + Turn{k} * b is a − b when fault k is on.
struct Turn {
  int number;
};
template <class T>
FAULT_BOTH T operator*(Turn turn, T b) {
  if (!fault(turn.number)) return b;
  if constexpr (requires { b.x; }) return T{-b.x, -b.y, -b.z};
  else return static_cast<T>(-b);
}

/// a * Gain{k} * b has a larger by a percent, an integer by one.
struct Gain {
  int number;
};
template <class T>
FAULT_BOTH T operator*(T a, Gain gain) {
  if (!fault(gain.number)) return a;
  if constexpr (static_cast<T>(0.5f) != T(0)) return static_cast<T>(1.01f) * a;
  else return a + 1;
}

/// a < Beyond{k} + b is a <= b.
struct Beyond {
  int number;
};
template <class T>
FAULT_BOTH T operator+(Beyond beyond, T b) {
  if (!fault(beyond.number)) return b;
  if constexpr (static_cast<T>(0.5f) != T(0))
    return b + (b < 0 ? -b : b) * static_cast<T>(sizeof(T) == 4 ? 1.2e-7 : 2.3e-16);
  else return b + 1;
}

}  // namespace decant::gpu
