/// \file
/// Work that is put together once and launched again and again.
#pragma once

#include "gpu/core/stream.cuh"

#include <functional>
#include <utility>
#include <vector>

namespace decant::gpu {
namespace {

#ifdef __CUDACC__

/// A CUDA graph. Beside fifteen threads that launch kernels, cudaStreamBeginCapture takes a millisecond, and so do
/// making and destroying an executable graph (one H200, CUDA 13.0); putting a graph together kernel by kernel and
/// updating an executable one takes 20 microseconds. So work that is kernels alone is not captured, and an executable
/// graph of the same kernels is given their other arguments and sizes.
class Graph {
 public:
  Graph() = default;
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;
  ~Graph() { destroy(); }

  /// Holds what `work` launches, in place of what it held before. \param branches  whether it has branches, whose
  /// handles belong to the graph that they were captured in
  template <class Work>
  void hold(Stream& stream, bool branches, Work work) {
    holds_ = false;
    LaunchList launches;
    if (!branches) launches = stream.list(work);
    const bool listed = !branches && launches.whole;
    const cudaGraph_t graph = listed ? launches.graph() : stream.capture(work);
    const std::vector<const void*> kernels = listed ? launches.kernels() : std::vector<const void*>();
    cudaGraphExecUpdateResultInfo result;
    cudaError_t error;
    if (executable_ && listed && kernels == kernels_) {
      error = cudaGraphExecUpdate(executable_, graph, &result);
    } else {
      destroy();
      error = cudaGraphInstantiate(&executable_, graph, 0);
      kernels_ = kernels;
    }
    cudaGraphDestroy(graph);
    CUDA_CHECK(error);
    holds_ = true;
  }
  bool holds_any() const { return holds_; }
  void launch(Stream& stream) { CUDA_CHECK(cudaGraphLaunch(executable_, stream.handle())); }
  /// It is to hold other work next.
  void clear() { holds_ = false; }

 private:
  void destroy() {
    if (executable_) cudaGraphExecDestroy(executable_);
    executable_ = nullptr;
    kernels_.clear();
  }

  cudaGraphExec_t executable_ = nullptr;
  std::vector<const void*> kernels_;  // of the executable, where they are known
  bool holds_ = false;
};

#else

class Graph {
 public:
  template <class Work>
  void hold(Stream&, bool, Work work) {
    work_ = work;
  }
  bool holds_any() const { return static_cast<bool>(work_); }
  void launch(Stream&) { work_(); }
  void clear() { work_ = nullptr; }

 private:
  std::function<void()> work_;
};

#endif

}  // namespace
}  // namespace decant::gpu
