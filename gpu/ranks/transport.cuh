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
    if (!ranks.asked_for_devices) ranks.between_devices = cuda::make_nccl_exchange(ranks);
    ranks.asked_for_devices = true;
#endif
  }

  /// send[k] to rank k, receive[k] from it, both on the device; what is received is there for what the stream does
  /// next.
  void exchange([[maybe_unused]] Stream& stream, std::span<const Segment> send, std::span<const Segment> receive) {
#ifdef __CUDACC__
    if (ranks_.between_devices) return ranks_.between_devices->exchange(send, receive, stream.handle());
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
  PinnedBuffer out_, in_;
#endif
  Communicator& ranks_;
};

}  // namespace
}  // namespace decant::gpu
