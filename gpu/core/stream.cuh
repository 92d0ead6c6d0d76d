/// \file
/// Kernels in order on one executor: launches, copies, algorithms, and CUDA graphs, in which the device itself
/// decides whether a branch runs (a conditional node).
#pragma once

#include "gpu/core/algorithms.hpp"
#include "gpu/core/buffer.cuh"
#include "gpu/core/teams.cuh"

#include <functional>
#include <utility>

namespace decant::gpu {
namespace {

#ifdef __CUDACC__

/// A branch of a graph; not there while no graph is captured.
struct Branch {
  cudaGraphConditionalHandle handle = 0;

  bool there() const { return handle != 0; }
  /// Makes it run when this launch of the graph gets there.
  DECANT_DEVICE void request() const {
    if (handle) cudaGraphSetConditional(handle, 1);
  }
};

/// Requests a branch where a flag is set.
DECANT_KERNEL(256) branch_kernel(int, Branch branch, const int* flag) {
  if (threadIdx.x == 0 && *flag != 0) branch.request();
}

class Stream {
 public:
  // What other threads do is refused while a stream that blocks theirs is captured.
  Stream() {
    CUDA_CHECK(cudaStreamCreateWithFlags(&captured_, cudaStreamNonBlocking));
    CUDA_CHECK(cudaStreamCreateWithFlags(&inner_, cudaStreamNonBlocking));
    keep_freed_memory();
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() {
    cudaStreamDestroy(captured_);
    cudaStreamDestroy(inner_);
  }

  /// kernel(n, arguments…) with a thread for each of n.
  template <class... Parameters, class... Arguments>
  void launch(void (*kernel)(int, Parameters...), int n, Arguments&&... arguments) {
    start(kernel, n, 256, 256, 0, std::forward<Arguments>(arguments)...);
  }
  /// kernel(n, arguments…) with a team for each of n particles.
  template <class Team, class... Parameters, class... Arguments>
  void launch_teams(void (*kernel)(int, Parameters...), int n, Arguments&&... arguments) {
    start(kernel, n, Team::particles_per_block, Team::block_size, 0, std::forward<Arguments>(arguments)...);
  }
  /// The same with so many bytes of dynamic shared memory per block.
  template <class Team, class... Parameters, class... Arguments>
  void launch_teams_sharing(std::size_t shared_bytes, void (*kernel)(int, Parameters...), int n,
                            Arguments&&... arguments) {
    start(kernel, n, Team::particles_per_block, Team::block_size, shared_bytes, std::forward<Arguments>(arguments)...);
  }
  void fill_zero(void* p, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemsetAsync(p, 0, bytes, stream_));
  }
  /// Reads as NaN or −1.
  void fill_ones(void* p, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemsetAsync(p, 0xFF, bytes, stream_));
  }
  void copy(void* to, const void* from, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream_));
  }
  /// algorithms.hpp
  void exclusive_scan(const int* in, int* out, int n, Buffer<char>& scratch) {
    cuda::exclusive_scan(in, out, n, scratch.get(), scratch.bytes(), stream_);
  }
  static void reserve_scan(int n, Buffer<char>& scratch) {
    const std::size_t bytes = cuda::scan_bytes(n);
    if (scratch.bytes() < bytes) scratch.resize(bytes);
  }
  void sort_by_key(int* keys, int* values, int n) { cuda::sort_by_key(keys, values, n, stream_); }
  void sort_pairs(Pairs& pairs, int n, int bits, Buffer<char>& scratch) {
    if (n <= 0) return;
    scratch.reserve(cuda::sort_bytes(n, bits));
    cuda::sort_pairs(pairs, n, bits, scratch.get(), scratch.bytes(), stream_);
  }
  void lower_bounds(const int* keys, int n, int* out, int count) { cuda::lower_bounds(keys, n, out, count, stream_); }

  /// Runs `then` where *flag is not 0 by then. In a graph the device decides at every launch: where `branch` is
  /// there, whoever sets the flag requests it as well, and nothing looks at the flag any more. Outside of one
  /// the host waits and looks.
  template <class Then>
  void when(const int* flag, Branch branch, Then then) {
    if (!capturing()) {
      int value = 0;
      CUDA_CHECK(cudaMemcpyAsync(&value, flag, sizeof value, cudaMemcpyDeviceToHost, stream_));
      CUDA_CHECK(cudaStreamSynchronize(stream_));
      if (agree_ ? agree_(value != 0) : value != 0) then();
      return;
    }
    if (!branch.there()) {
      branch = new_branch();
      launch(branch_kernel, 1, branch, flag);
    }
    cudaStreamCaptureStatus capturing;
    cudaGraph_t graph = nullptr;
    const cudaGraphNode_t* before = nullptr;
    std::size_t count = 0;
    CUDA_CHECK(cudaStreamGetCaptureInfo(stream_, &capturing, nullptr, &graph, &before, nullptr, &count));
    cudaGraphNodeParams parameters{};
    parameters.type = cudaGraphNodeTypeConditional;
    parameters.conditional.handle = branch.handle;
    parameters.conditional.type = cudaGraphCondTypeIf;
    parameters.conditional.size = 1;
    cudaGraphNode_t node = nullptr;
    CUDA_CHECK(cudaGraphAddNode(&node, graph, before, nullptr, count, &parameters));
    CUDA_CHECK(cudaStreamUpdateCaptureDependencies(stream_, &node, nullptr, 1, cudaStreamSetCaptureDependencies));
    capture_into(parameters.conditional.phGraph_out[0], then);
  }
  /// From here on what `when` runs outside of a graph is decided by agree(whether *flag is not 0).
  void agree_by(std::function<bool(bool)> agree) { agree_ = std::move(agree); }
  /// For a `when` that is yet to come and must come; not there unless a graph is captured.
  Branch new_branch() {
    Branch branch;
    if (!capturing()) return branch;
    cudaStreamCaptureStatus capturing;
    cudaGraph_t graph = nullptr;
    CUDA_CHECK(cudaStreamGetCaptureInfo(stream_, &capturing, nullptr, &graph, nullptr, nullptr, nullptr));
    CUDA_CHECK(cudaGraphConditionalHandleCreate(&branch.handle, graph, 0, cudaGraphCondAssignDefault));
    return branch;
  }

  /// What `work` launches, as a graph; none of it runs.
  template <class Work>
  cudaGraph_t capture(Work work) {
    cudaGraph_t graph = nullptr;
    CUDA_CHECK(cudaStreamBeginCapture(captured_, cudaStreamCaptureModeThreadLocal));
    std::swap(stream_, captured_);
    work();
    std::swap(stream_, captured_);
    CUDA_CHECK(cudaStreamEndCapture(captured_, &graph));
    return graph;
  }

  void wait() { CUDA_CHECK(cudaStreamSynchronize(stream_)); }
  cudaStream_t handle() const { return stream_; }

 private:
  bool capturing() const { return stream_ != own_stream; }

  template <class... Parameters, class... Arguments>
  void start(void (*kernel)(int, Parameters...), int n, int per_block, int threads, std::size_t shared_bytes,
             Arguments&&... arguments) {
    if (n <= 0) return;
    kernel<<<(n + per_block - 1) / per_block, threads, shared_bytes, stream_>>>(n, arguments...);
    CUDA_CHECK(cudaGetLastError());
  }
  /// So that loading one small problem after the other does not go to the driver for each array.
  static void keep_freed_memory() {
    int device = 0;
    cudaMemPool_t pool = nullptr;
    std::uint64_t kept = 256u << 20;
    CUDA_CHECK(cudaGetDevice(&device));
    CUDA_CHECK(cudaDeviceGetDefaultMemPool(&pool, device));
    CUDA_CHECK(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &kept));
  }

  template <class Work>
  void capture_into(cudaGraph_t graph, Work work) {
    CUDA_CHECK(cudaStreamBeginCaptureToGraph(inner_, graph, nullptr, nullptr, 0, cudaStreamCaptureModeThreadLocal));
    std::swap(stream_, inner_);
    work();
    std::swap(stream_, inner_);
    CUDA_CHECK(cudaStreamEndCapture(inner_, &graph));
  }

  cudaStream_t stream_ = own_stream, captured_ = nullptr, inner_ = nullptr;
  std::function<bool(bool)> agree_;
};

/// Work that is captured once and launched again and again.
class Graph {
 public:
  Graph() = default;
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;
  ~Graph() { clear(); }

  template <class Work>
  void capture(Stream& stream, Work work) {
    clear();
    const cudaGraph_t graph = stream.capture(work);
    const cudaError_t error = cudaGraphInstantiate(&executable_, graph, 0);
    cudaGraphDestroy(graph);
    CUDA_CHECK(error);
  }
  bool captured() const { return executable_ != nullptr; }
  void launch(Stream& stream) { CUDA_CHECK(cudaGraphLaunch(executable_, stream.handle())); }
  void clear() {
    if (executable_) cudaGraphExecDestroy(executable_);
    executable_ = nullptr;
  }

 private:
  cudaGraphExec_t executable_ = nullptr;
};

#else

struct Branch {
  void request() const {}
};

/// Each call has done its work when it returns.
class Stream {
 public:
  template <class... Parameters, class... Arguments>
  void launch(void (*kernel)(int, Parameters...), int n, Arguments&&... arguments) {
    if (n > 0) kernel(n, arguments...);
  }
  template <class Team, class... Parameters, class... Arguments>
  void launch_teams(void (*kernel)(int, Parameters...), int n, Arguments&&... arguments) {
    if (n > 0) kernel(n, arguments...);
  }
  template <class Team, class... Parameters, class... Arguments>
  void launch_teams_sharing(std::size_t, void (*kernel)(int, Parameters...), int n, Arguments&&... arguments) {
    if (n > 0) kernel(n, arguments...);
  }
  void fill_zero(void* p, std::size_t bytes) {
    if (bytes) std::memset(p, 0, bytes);
  }
  void fill_ones(void* p, std::size_t bytes) {
    if (bytes) std::memset(p, 0xFF, bytes);
  }
  void copy(void* to, const void* from, std::size_t bytes) {
    if (bytes) std::memcpy(to, from, bytes);
  }
  void exclusive_scan(const int* in, int* out, int n, Buffer<char>&) { host::exclusive_scan(in, out, n); }
  static void reserve_scan(int, Buffer<char>&) {}
  void sort_by_key(int* keys, int* values, int n) { host::sort_by_key(keys, values, n); }
  void sort_pairs(Pairs& pairs, int n, int bits, Buffer<char>&) { host::sort_pairs(pairs, n, bits); }
  void lower_bounds(const int* keys, int n, int* out, int count) { host::lower_bounds(keys, n, out, count); }
  template <class Then>
  void when(const int* flag, Branch, Then then) {
    if (agree_ ? agree_(*flag != 0) : *flag != 0) then();
  }
  void agree_by(std::function<bool(bool)> agree) { agree_ = std::move(agree); }
  Branch new_branch() { return {}; }
  void wait() {}

 private:
  std::function<bool(bool)> agree_;
};

class Graph {
 public:
  template <class Work>
  void capture(Stream&, Work work) {
    work_ = work;
  }
  bool captured() const { return static_cast<bool>(work_); }
  void launch(Stream&) { work_(); }
  void clear() { work_ = nullptr; }

 private:
  std::function<void()> work_;
};

#endif

}  // namespace
}  // namespace decant::gpu
