/// \file
/// How a thread writes integers one by one and sends them to memory by fours.
#pragma once

#include "gpu/core/executor.cuh"

namespace decant::gpu {
namespace {

#ifdef __CUDACC__
/// Dynamic shared memory of a block, as much as its launch gave it.
DECANT_DEVICE char* shared_memory() {
  extern __shared__ int4 decant_shared[];
  return reinterpret_cast<char*>(decant_shared);
}
#endif

/// In shared memory, at its beginning, since a thread's own memory cannot be indexed. Appending takes two
/// instructions.
class StagingBuffer {
 public:
  static constexpr int capacity = 16;
  // Bytes per thread: a distance that keeps eight threads that access words out of each other's banks.
  static constexpr int stride = 4 * capacity + 16;
  DECANT_DEVICE StagingBuffer() : at_(begin()) {}
  StagingBuffer(const StagingBuffer&) = delete;
  StagingBuffer& operator=(const StagingBuffer&) = delete;

  /// There must be room: `flush` in time.
  DECANT_DEVICE void append(bool really, int value) {
    if (!really) return;
    *reinterpret_cast<int*>(memory() + at_) = value;
    at_ += 4;
  }
  DECANT_DEVICE int size() const { return (at_ - begin()) / 4; }
  /// send(int4) for every whole word, unless there is room for `more` and that goes for the threads that
  /// run beside this one: what all do at once costs as much as what one does.
  template <class Send>
  DECANT_DEVICE void flush(int more, Send&& send) {
    const bool full = size() + more > capacity;
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
  DECANT_DEVICE int4& word(int at) { return *reinterpret_cast<int4*>(memory() + at); }
#ifdef __CUDACC__
  DECANT_DEVICE static char* memory() { return shared_memory(); }
  DECANT_DEVICE static int begin() { return static_cast<int>(threadIdx.x) * stride; }
#else
  char* memory() { return reinterpret_cast<char*>(all_); }
  static int begin() { return 0; }
  int4 all_[capacity / 4 + 1]{};
#endif
  int at_;  // bytes, so that an address is one sum
};

}  // namespace
}  // namespace decant::gpu
