/// \file
/// Kernels in order on one executor: launches, copies and algorithms, run, listed or captured for a graph, in which the
/// device itself decides whether a branch runs (a conditional node).
#pragma once

#include "gpu/core/algorithms.hpp"
#include "gpu/core/buffer.cuh"
#include "gpu/core/launch_list.cuh"
#include "gpu/core/teams.cuh"
#include "gpu/core/transfers.cuh"

#include <functional>
#include <type_traits>
#include <utility>
#include <vector>

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
  /// Buffer::resize, upload and upload_at, small ones together before whatever comes next.
  template <class T>
  void resize(Buffer<T>& buffer, std::size_t n) {
    buffer.set_size(n);
    if (buffer.bytes() <= most_put_off) transfers_.fill_ones(buffer.get(), buffer.bytes());
    else buffer.resize(n);
  }
  template <class T>
  void upload(Buffer<T>& buffer, const std::vector<T>& from) {
    if (buffer.size() < from.size()) resize(buffer, from.size());
    upload_at(buffer, 0, from);
  }
  template <class T>
  void upload_at(Buffer<T>& buffer, std::size_t first, const std::vector<T>& from) {
    if (buffer.bytes() <= most_put_off) transfers_.upload(buffer.get() + first, from.data(), from.size() * sizeof(T));
    else buffer.upload_at(first, from);
  }
  /// Whoever frees such a buffer, or touches it other than through the stream, runs or forgets what was put off.
  void run_transfers() {
    if (!transfers_.empty()) transfers_.run(stream_);
  }
  void forget_transfers() { transfers_.clear(); }
  void fill_zero(void* p, std::size_t bytes) {
    if (list_other()) return;
    run_transfers();
    if (bytes) CUDA_CHECK(cudaMemsetAsync(p, 0, bytes, stream_));
  }
  /// Reads as NaN or −1.
  void fill_ones(void* p, std::size_t bytes) {
    if (list_other()) return;
    run_transfers();
    if (bytes) CUDA_CHECK(cudaMemsetAsync(p, 0xFF, bytes, stream_));
  }
  void copy(void* to, const void* from, std::size_t bytes) {
    if (list_other()) return;
    run_transfers();
    if (bytes) CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream_));
  }
  /// algorithms.hpp
  void exclusive_scan(const int* in, int* out, int n, Buffer<char>& scratch) {
    if (n <= most_scanned_by_a_block) return start(scan_kernel, 1, 1, scan_threads, 0, n, in, out);
    if (list_other()) return;
    run_transfers();
    cuda::exclusive_scan(in, out, n, scratch.get(), scratch.bytes(), stream_);
  }
  static void reserve_scan(int n, Buffer<char>& scratch) {
    const std::size_t bytes = cuda::scan_bytes(n);
    if (scratch.bytes() < bytes) scratch.resize(bytes);
  }
  void sort_by_key(int* keys, int* values, int n) {
    run_transfers();
    cuda::sort_by_key(keys, values, n, stream_);
  }
  void sort_pairs(Pairs& pairs, int n, int bits, Buffer<char>& scratch) {
    if (n <= 0) return;
    run_transfers();
    scratch.reserve(cuda::sort_bytes(n, bits));
    cuda::sort_pairs(pairs, n, bits, scratch.get(), scratch.bytes(), stream_);
  }
  void lower_bounds(const int* keys, int n, int* out, int count) {
    run_transfers();
    cuda::lower_bounds(keys, n, out, count, stream_);
  }

  /// Runs `then` where *flag is not 0 by then. In a graph the device decides at every launch: where `branch` is
  /// there, whoever sets the flag requests it as well, and nothing looks at the flag any more. Outside of one
  /// the host waits and looks.
  template <class Then>
  void when(const int* flag, Branch branch, Then then) {
    if (list_other()) return;
    if (!capturing()) {
      run_transfers();
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
    if (!capturing() || list_other()) return branch;
    cudaStreamCaptureStatus capturing;
    cudaGraph_t graph = nullptr;
    CUDA_CHECK(cudaStreamGetCaptureInfo(stream_, &capturing, nullptr, &graph, nullptr, nullptr, nullptr));
    CUDA_CHECK(cudaGraphConditionalHandleCreate(&branch.handle, graph, 0, cudaGraphCondAssignDefault));
    return branch;
  }

  /// What `work` launches; none of it runs.
  template <class Work>
  LaunchList list(Work work) {
    struct Ending {
      LaunchList*& listed;
      ~Ending() { listed = nullptr; }
    } ending{listed_};
    run_transfers();
    LaunchList launches;
    listed_ = &launches;
    work();
    return launches;
  }
  /// What `work` launches, as a graph; none of it runs.
  template <class Work>
  cudaGraph_t capture(Work work) {
    run_transfers();
    cudaGraph_t graph = nullptr;
    CUDA_CHECK(cudaStreamBeginCapture(captured_, cudaStreamCaptureModeThreadLocal));
    std::swap(stream_, captured_);
    work();
    std::swap(stream_, captured_);
    CUDA_CHECK(cudaStreamEndCapture(captured_, &graph));
    return graph;
  }

  void wait() {
    run_transfers();
    CUDA_CHECK(cudaStreamSynchronize(stream_));
  }
  cudaStream_t handle() {
    run_transfers();
    return stream_;
  }

 private:
  bool capturing() const { return stream_ != own_stream; }

  template <class... Parameters, class... Arguments>
  void start(void (*kernel)(int, Parameters...), int n, int per_block, int threads, std::size_t shared_bytes,
             Arguments&&... arguments) {
    if (n <= 0) return;
    const int blocks = (n + per_block - 1) / per_block;
    if (listed_) return listed_->add(kernel, blocks, threads, shared_bytes, n, arguments...);
    run_transfers();
    kernel<<<blocks, threads, shared_bytes, stream_>>>(n, arguments...);
    CUDA_CHECK(cudaGetLastError());
  }
  /// Whether launches are only listed, and this is none of a kernel.
  bool list_other() {
    if (listed_) listed_->whole = false;
    return listed_ != nullptr;
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
  LaunchList* listed_ = nullptr;
  TransferQueue transfers_;
  std::function<bool(bool)> agree_;
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
  template <class T>
  void resize(Buffer<T>& buffer, std::size_t n) {
    buffer.resize(n);
  }
  template <class T>
  void upload(Buffer<T>& buffer, const std::vector<T>& from) {
    buffer.upload(from);
  }
  template <class T>
  void upload_at(Buffer<T>& buffer, std::size_t first, const std::vector<T>& from) {
    buffer.upload_at(first, from);
  }
  void run_transfers() {}
  void forget_transfers() {}
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

#endif

}  // namespace
}  // namespace decant::gpu
