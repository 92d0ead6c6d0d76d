/// \file
/// How long the stages of substeps take on the device, and the ranges that Nsight shows.
#pragma once

#include "gpu/core/stream.cuh"

#ifdef __CUDACC__
#include <nvtx3/nvToolsExt.h>
#else
#include <chrono>
#endif

namespace decant::gpu {
namespace {

/// An NVTX range, from here to the end of the scope; nothing on the host.
class NamedRange {
 public:
#ifdef __CUDACC__
  explicit NamedRange(const char* name) { nvtxRangePushA(name); }
  ~NamedRange() { nvtxRangePop(); }
#else
  explicit NamedRange(const char*) {}
  ~NamedRange() {}
#endif
  NamedRange(const NamedRange&) = delete;
  NamedRange& operator=(const NamedRange&) = delete;
};

/// Seconds from one lap to the next, since `start`, which may come again and again; `read` waits for the device
/// and adds up.
class StageTimer {
#ifdef __CUDACC__

 public:
  StageTimer() = default;
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;
  ~StageTimer() {
    for (auto e : events_) cudaEventDestroy(e);
  }
  void start(Stream& stream) {
    if (used_ > 0) laps_.push_back(nullptr);
    record(stream);
  }
  void lap(Stream& stream, StageTimes::Stage& stage) {
    laps_.push_back(&stage);
    record(stream);
  }
  void read() {
    if (used_ == 0) return;
    CUDA_CHECK(cudaEventSynchronize(events_[used_ - 1]));
    for (std::size_t k = 0; k < laps_.size(); ++k) {
      if (!laps_[k]) continue;
      float milliseconds = 0;
      CUDA_CHECK(cudaEventElapsedTime(&milliseconds, events_[k], events_[k + 1]));
      laps_[k]->seconds += 1e-3 * milliseconds;
      ++laps_[k]->calls;
    }
    laps_.clear();
    used_ = 0;
  }

 private:
  void record(Stream& stream) {
    if (used_ == events_.size()) {
      events_.emplace_back();
      CUDA_CHECK(cudaEventCreate(&events_.back()));
    }
    CUDA_CHECK(cudaEventRecord(events_[used_++], stream.handle()));
  }
  std::vector<cudaEvent_t> events_;
  std::vector<StageTimes::Stage*> laps_;
  std::size_t used_ = 0;

#else

 public:
  void start(Stream&) { last_ = std::chrono::steady_clock::now(); }
  void lap(Stream&, StageTimes::Stage& stage) {
    const auto now = std::chrono::steady_clock::now();
    stage.seconds += std::chrono::duration<double>(now - last_).count();
    ++stage.calls;
    last_ = now;
  }
  void read() {}

 private:
  std::chrono::steady_clock::time_point last_;

#endif
};

}  // namespace
}  // namespace decant::gpu
