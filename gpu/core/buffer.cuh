/// \file
/// Device memory.
#pragma once

#include "gpu/core/executor.cuh"

#ifdef __CUDACC__
#include "gpu/core/cuda_check.hpp"
#endif

#include <unordered_map>
#include <utility>
#include <vector>

namespace decant::gpu {
namespace {

#ifdef __CUDACC__
/// The calling thread's own, so that backends on several threads wait for nobody else's work. Whoever
/// hands a backend to another thread does so between its calls, at whose end all is done.
inline const cudaStream_t own_stream = cudaStreamPerThread;

/// Small blocks that this thread's buffers gave back, for buffers of exactly their size: whoever loads small problems
/// one after the other asks for the same sizes again and again, and threads that ask the driver wait for each other.
class SpareBlocks {
 public:
  SpareBlocks() = default;
  SpareBlocks(const SpareBlocks&) = delete;
  SpareBlocks& operator=(const SpareBlocks&) = delete;
  ~SpareBlocks() {
    for (const auto& [bytes, block] : blocks_) cudaFreeAsync(block, own_stream);
  }
  static SpareBlocks& of_this_thread() {
    thread_local SpareBlocks blocks;
    return blocks;
  }

  void* take(std::size_t bytes) {
    const auto at = blocks_.find(bytes);
    if (at == blocks_.end()) return nullptr;
    void* block = at->second;
    blocks_.erase(at);
    total_ -= bytes;
    return block;
  }
  /// False where it is not kept.
  bool keep(void* block, std::size_t bytes) {
    if (bytes > largest || total_ + bytes > most) return false;
    blocks_.emplace(bytes, block);
    total_ += bytes;
    return true;
  }

 private:
  static constexpr std::size_t largest = 1u << 20, most = 64u << 20;

  std::unordered_multimap<std::size_t, void*> blocks_;
  std::size_t total_ = 0;
};
#endif

/// From device memory; all of it is there when the call returns.
inline void copy_to_host(void* to, const void* from, std::size_t bytes) {
  if (bytes == 0) return;
#ifdef __CUDACC__
  CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, own_stream));
  CUDA_CHECK(cudaStreamSynchronize(own_stream));
#else
  std::memcpy(to, from, bytes);
#endif
}

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
    set_size(n);
    fill_ones(data_, size_ * sizeof(T));
  }
  /// The same, for who fills it.
  void set_size(std::size_t n) {
    if (n == size_) return;
    release();
    if (n > 0) data_ = static_cast<T*>(allocate(n * sizeof(T)));
    size_ = n;
  }
  /// At least so many elements, contents undefined; with a fifth more, so that it seldom happens.
  void reserve(std::size_t n) {
    if (size_ < n) resize(n + n / 5);
  }
  /// More elements; the first `kept` are still there.
  void grow(std::size_t n, std::size_t kept) {
    if (n <= size_) return;
    Buffer larger(n);
    copy_inside(larger.data_, data_, kept * sizeof(T));
    std::swap(data_, larger.data_);
    std::swap(size_, larger.size_);
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
    copy_to_host(to.data(), data_, n * sizeof(T));
    return to;
  }
  /// From an address inside.
  void download_bytes(void* to, const void* from, std::size_t bytes) const { copy_to_host(to, from, bytes); }
  T* get() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

 private:
#ifdef __CUDACC__
  static void* allocate(std::size_t bytes) {
    void* p = SpareBlocks::of_this_thread().take(bytes);
    if (!p) CUDA_CHECK(cudaMallocAsync(&p, bytes, own_stream));
    return p;
  }
  static void fill_ones(void* p, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemsetAsync(p, 0xFF, bytes, own_stream));
  }
  /// From pageable memory, which has been read when the call returns.
  static void copy_in(void* to, const void* from, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, own_stream));
  }
  static void copy_inside(void* to, const void* from, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, own_stream));
  }
  void release() {
    if (data_ && !SpareBlocks::of_this_thread().keep(data_, size_ * sizeof(T)))
      cudaFreeAsync(data_, own_stream);  // a destructor has nobody to report to
    data_ = nullptr;
    size_ = 0;
  }
#else
  static void* allocate(std::size_t bytes) { return ::operator new(bytes, std::align_val_t(64)); }
  static void fill_ones(void* p, std::size_t bytes) {
    if (bytes) std::memset(p, 0xFF, bytes);
  }
  static void copy_in(void* to, const void* from, std::size_t bytes) {
    if (bytes) std::memcpy(to, from, bytes);
  }
  static void copy_inside(void* to, const void* from, std::size_t bytes) {
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

/// Host memory that the device writes to directly: a copy to other memory goes through a small buffer of the
/// driver's, at a fraction of the speed.
class PinnedBuffer {
 public:
  PinnedBuffer() = default;
  PinnedBuffer(const PinnedBuffer&) = delete;
  PinnedBuffer& operator=(const PinnedBuffer&) = delete;
  ~PinnedBuffer() { release(data_); }

  /// n elements from device memory, there until the next call.
  template <class T>
  const T* download(const T* from, std::size_t n) {
    auto* to = static_cast<T*>(reserve(n * sizeof(T)));
    copy_to_host(to, from, n * sizeof(T));
    return to;
  }
  /// Room for so many bytes, there until the next call.
  void* reserve(std::size_t bytes) {
    if (bytes > size_) {
      release(std::exchange(data_, nullptr));
      size_ = 0;
      data_ = allocate(bytes);
      size_ = bytes;
    }
    return data_;
  }

 private:
#ifdef __CUDACC__
  static void* allocate(std::size_t bytes) {
    void* p = nullptr;
    CUDA_CHECK(cudaMallocHost(&p, bytes));
    return p;
  }
  static void release(void* p) { cudaFreeHost(p); }
#else
  static void* allocate(std::size_t bytes) { return ::operator new(bytes); }
  static void release(void* p) { ::operator delete(p); }
#endif
  void* data_ = nullptr;
  std::size_t size_ = 0;  // bytes
};

/// The next `count` elements of a buffer that several arrays share, from byte `offset` on, which moves behind
/// them.
template <class T>
T* carve(const Buffer<char>& from, std::size_t& offset, std::size_t count) {
  T* p = reinterpret_cast<T*>(from.get() + offset);
  offset += count * sizeof(T);
  return p;
}

}  // namespace
}  // namespace decant::gpu
