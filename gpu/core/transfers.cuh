/// \file
/// Small fills and uploads, put off until the next kernel and then done all at once. Loading a problem of some hundred
/// particles is forty of them; each takes the driver some microseconds, for which other threads wait.
#pragma once

#include "gpu/core/buffer.cuh"

#include <cstdint>
#include <cstring>
#include <vector>

namespace decant::gpu {
namespace {

/// Buffers with so many bytes or fewer are filled and uploaded together.
inline constexpr std::size_t most_put_off = 64u << 10;

#ifdef __CUDACC__

/// `bytes` to `to`: from byte `from` of what was uploaded; < 0: 0xFF each.
struct Transfer {
  char* to;
  std::uint32_t bytes;
  std::int32_t from;
};

inline constexpr int blocks_per_transfer = 8;

/// blocks_per_transfer blocks for each of n transfers.
DECANT_KERNEL(256) transfer_kernel(int n, const Transfer* list, const char* uploaded) {
  const int which = static_cast<int>(blockIdx.x) / blocks_per_transfer;
  if (which >= n) return;
  const Transfer t = list[which];
  const auto first = blockIdx.x % blocks_per_transfer * blockDim.x + threadIdx.x;
  const auto whole = t.bytes / 4;
  for (auto k = first; k < whole; k += blocks_per_transfer * blockDim.x)
    reinterpret_cast<int*>(t.to)[k] = t.from < 0 ? -1 : reinterpret_cast<const int*>(uploaded + t.from)[k];
  const auto rest = 4 * whole + first;
  if (rest < t.bytes) t.to[rest] = t.from < 0 ? static_cast<char>(-1) : uploaded[t.from + rest];
}

class TransferQueue {
 public:
  bool empty() const { return list_.empty(); }
  /// Each after what was put off before, where that is to the same place.
  void fill_ones(void* to, std::size_t bytes) {
    if (bytes == 0) return;
    forget_inside(static_cast<char*>(to), bytes);
    list_.push_back({static_cast<char*>(to), static_cast<std::uint32_t>(bytes), -1});
  }
  void upload(void* to, const void* from, std::size_t bytes) {
    if (bytes == 0) return;
    forget_inside(static_cast<char*>(to), bytes);
    const std::size_t at = (data_.size() + 15) / 16 * 16;
    data_.resize(at + bytes);
    std::memcpy(data_.data() + at, from, bytes);
    list_.push_back({static_cast<char*>(to), static_cast<std::uint32_t>(bytes), static_cast<std::int32_t>(at)});
  }
  void run(cudaStream_t stream) {
    const std::size_t list_bytes = list_.size() * sizeof(Transfer), data_at = (list_bytes + 15) / 16 * 16;
    packed_.resize(data_at + data_.size());
    std::memcpy(packed_.data(), list_.data(), list_bytes);
    if (!data_.empty()) std::memcpy(packed_.data() + data_at, data_.data(), data_.size());
    if (uploaded_.size() < packed_.size()) uploaded_.resize(2 * packed_.size());
    CUDA_CHECK(cudaMemcpyAsync(uploaded_.get(), packed_.data(), packed_.size(), cudaMemcpyHostToDevice, stream));
    const int n = static_cast<int>(list_.size());
    transfer_kernel<<<n * blocks_per_transfer, 256, 0, stream>>>(n, reinterpret_cast<const Transfer*>(uploaded_.get()),
                                                                 uploaded_.get() + data_at);
    CUDA_CHECK(cudaGetLastError());
    clear();
  }
  void clear() {
    list_.clear();
    data_.clear();
  }

 private:
  /// All transfers run side by side: of two to one place the later one counts.
  void forget_inside(char* to, std::size_t bytes) {
    std::vector<Transfer> kept;
    for (const Transfer& t : list_) {
      char *const begin = t.to, *const end = t.to + t.bytes, *const from = to, *const until = to + bytes;
      if (end <= from || begin >= until) {
        kept.push_back(t);
        continue;
      }
      const auto part = [&](char* part_begin, char* part_end) {
        if (part_begin >= part_end) return;
        const auto offset = static_cast<std::int32_t>(part_begin - begin);
        kept.push_back(
            {part_begin, static_cast<std::uint32_t>(part_end - part_begin), t.from < 0 ? t.from : t.from + offset});
      };
      part(begin, from);
      part(until, end);
    }
    list_ = std::move(kept);
  }

  std::vector<Transfer> list_;
  std::vector<char> data_, packed_;  // uploaded; behind the list
  Buffer<char> uploaded_;
};

#endif

}  // namespace
}  // namespace decant::gpu
