/// \file
/// Bytes from the device memory of one rank to that of another.
#pragma once

#include "gpu/core/stream.cuh"
#include "gpu/ranks/communicator.hpp"
#include "gpu/ranks/nccl_exchange.hpp"

#include <span>

namespace decant::gpu {
namespace {

/// Between devices by NCCL, or through host memory, which always works.
class Transport {
 public:
  /// All ranks make theirs together.
  explicit Transport(Communicator& ranks) : ranks_(ranks) {
#ifdef __CUDACC__
    if (!ranks.between_devices) ranks.between_devices = cuda::make_nccl_exchange(ranks);
    between_devices_ = ranks.between_devices->get();
    int least = 0, most = 0;
    CUDA_CHECK(cudaDeviceGetStreamPriorityRange(&least, &most));
    CUDA_CHECK(cudaStreamCreateWithPriority(&beside_, cudaStreamNonBlocking, most));
    for (cudaEvent_t* event : {&packed_, &received_})
      CUDA_CHECK(cudaEventCreateWithFlags(event, cudaEventDisableTiming));
#endif
  }
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  ~Transport() {
#ifdef __CUDACC__
    cudaStreamDestroy(beside_);
    cudaEventDestroy(packed_);
    cudaEventDestroy(received_);
#endif
  }

  /// send[k] to rank k, receive[k] from it, both on the device; what is received is there for what the stream does
  /// next.
  void exchange([[maybe_unused]] Stream& stream, std::span<const Segment> send, std::span<const Segment> receive) {
#ifdef __CUDACC__
    if (between_devices_) return between_devices_->exchange(send, receive, stream.handle());
    std::vector<Segment> from = staged(send, out_), to = staged(receive, in_);
    for (std::size_t k = 0; k < send.size(); ++k)
      if (send[k].bytes > 0)
        CUDA_CHECK(cudaMemcpyAsync(from[k].data, send[k].data, send[k].bytes, cudaMemcpyDeviceToHost, stream.handle()));
    stream.wait();
    ranks_.exchange(from, to);
    for (std::size_t k = 0; k < receive.size(); ++k)
      if (receive[k].bytes > 0)
        CUDA_CHECK(cudaMemcpyAsync(receive[k].data, to[k].data, to[k].bytes, cudaMemcpyHostToDevice, stream.handle()));
    stream.wait();
#else
    ranks_.exchange(send, receive);
#endif
  }

  /// The same beside what the stream does until `finish`, where that is between devices.
  void start([[maybe_unused]] Stream& stream, std::vector<Segment> send, std::vector<Segment> receive) {
#ifdef __CUDACC__
    if (between_devices_) {
      CUDA_CHECK(cudaEventRecord(packed_, stream.handle()));
      CUDA_CHECK(cudaStreamWaitEvent(beside_, packed_));
      between_devices_->exchange(send, receive, beside_);
      CUDA_CHECK(cudaEventRecord(received_, beside_));
      return;
    }
#endif
    send_ = std::move(send);
    receive_ = std::move(receive);
  }
  void finish(Stream& stream) {
#ifdef __CUDACC__
    if (between_devices_) {
      CUDA_CHECK(cudaStreamWaitEvent(stream.handle(), received_));
      return;
    }
#endif
    exchange(stream, send_, receive_);
  }

 private:
#ifdef __CUDACC__
  static std::vector<Segment> staged(std::span<const Segment> segments, PinnedBuffer& memory) {
    std::size_t total = 0;
    for (const Segment& s : segments) total += s.bytes;
    auto* at = static_cast<std::byte*>(memory.reserve(total));
    std::vector<Segment> out;
    for (const Segment& s : segments) {
      out.push_back({at, s.bytes});
      at += s.bytes;
    }
    return out;
  }
  DeviceExchange* between_devices_ = nullptr;
  PinnedBuffer out_, in_;
  cudaStream_t beside_ = nullptr;
  cudaEvent_t packed_ = nullptr, received_ = nullptr;
#endif
  std::vector<Segment> send_, receive_;  // begun
  Communicator& ranks_;
};

}  // namespace
}  // namespace decant::gpu
