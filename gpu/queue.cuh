/// \file
/// Order of work on an executor: passes run one after the other; a Recording repeats a sequence of
/// them without the host (a CUDA graph); a branch is decided on the device (a conditional node).
#pragma once

#include "gpu/steps.cuh"
#include "gpu/team.cuh"

#ifdef __CUDACC__
#include <cub/device/device_scan.cuh>
#include <thrust/binary_search.h>
#include <thrust/sort.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/system/cuda/execution_policy.h>
#else
#include <thrust/binary_search.h>
#include <thrust/for_each.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/scan.h>
#include <thrust/sort.h>
#include <thrust/system/omp/execution_policy.h>

#include <chrono>
#endif

#include <functional>
#include <map>

namespace decant::gpu::DECANT_EXECUTOR {

#ifdef __CUDACC__

/// Makes a branch of a recording run when the queue gets there in this replay.
struct Wake {
  cudaGraphConditionalHandle branch = 0;  // 0: there is none to wake
  DECANT_DEVICE void operator()() const {
    if (branch) cudaGraphSetConditional(branch, 1);
  }
};

struct DecidePass {
  Wake wake;
  const int* flag;
  DECANT_DEVICE void operator()(int) const {
    if (*flag != 0) wake();
  }
};

/// Passes in order on the calling thread's stream.
class Queue {
 public:
  // What other threads do is refused while a stream that blocks theirs is captured.
  Queue() {
    CUDA_CHECK(cudaStreamCreateWithFlags(&recorded_, cudaStreamNonBlocking));
    CUDA_CHECK(cudaStreamCreateWithFlags(&inner_, cudaStreamNonBlocking));
    keep_freed_memory();
  }
  Queue(const Queue&) = delete;
  Queue& operator=(const Queue&) = delete;
  ~Queue() {
    cudaStreamDestroy(recorded_);
    cudaStreamDestroy(inner_);
  }

  /// body(i) for i in 0 … n−1.
  template <class Body>
  void for_each(int n, Body body) {
    if (n <= 0) return;
    particle_kernel<<<(n + 255) / 256, 256, 0, stream_>>>(n, body);
    CUDA_CHECK(cudaGetLastError());
  }
  /// body(team) with a TileTeam, for particles 0 … n−1.
  template <class Body>
  void for_each_tile_team(int n, Body body) {
    if (n <= 0) return;
    constexpr int particles = TileTeam::particles;
    tile_kernel<<<(n + particles - 1) / particles, tile_size, 0, stream_>>>(n, body);
    CUDA_CHECK(cudaGetLastError());
  }
  /// body(group) with a Group, for particles 0 … n−1.
  template <int lanes, class Body>
  void for_each_group(int n, Body body) {
    if (n <= 0) return;
    constexpr int particles = group_block / lanes;
    constexpr std::size_t desk = desk_bytes<lanes, Body>(group_block);
    group_kernel<lanes>
        <<<(n + particles - 1) / particles, group_block, desk, stream_>>>(n, body);
    CUDA_CHECK(cudaGetLastError());
  }
  void fill_zero(void* p, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemsetAsync(p, 0, bytes, stream_));
  }
  void copy(void* to, const void* from, std::size_t bytes) {
    if (bytes) CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream_));
  }
  /// out[k] = in[0] + … + in[k−1], k < n.
  void exclusive_scan(const int* in, int* out, int n, Buffer<char>& scratch) {
    std::size_t bytes = scratch.bytes();
    CUDA_CHECK(cub::DeviceScan::ExclusiveSum(scratch.get(), bytes, in, out, n, stream_));
  }
  static void reserve_scan(int n, Buffer<char>& scratch) {
    std::size_t bytes = 0;
    CUDA_CHECK(cub::DeviceScan::ExclusiveSum(nullptr, bytes, static_cast<const int*>(nullptr),
                                             static_cast<int*>(nullptr), n));
    if (scratch.bytes() < bytes) scratch.resize(bytes);
  }
  /// Stable. Allocates, so it cannot be recorded.
  void sort_by_key(int* keys, int* values, int n) {
    thrust::stable_sort_by_key(thrust::cuda::par.on(stream_), keys, keys + n, values);
  }
  /// out[k] = how many of the sorted keys are below k, k < count.
  void lower_bounds(const int* keys, int n, int* out, int count) {
    thrust::lower_bound(thrust::cuda::par.on(stream_), keys, keys + n,
                        thrust::counting_iterator<int>(0), thrust::counting_iterator<int>(count),
                        out);
  }

  /// Runs `then` where *flag is not 0 when the queue gets there. While recording the device decides at
  /// every replay; else the host waits and looks.
  template <class Then>
  void when(const int* flag, Then then) {
    if (!recording()) {
      int value = 0;
      CUDA_CHECK(cudaMemcpyAsync(&value, flag, sizeof value, cudaMemcpyDeviceToHost, stream_));
      CUDA_CHECK(cudaStreamSynchronize(stream_));
      if (value != 0) then();
      return;
    }
    const bool decided = next_.branch != 0;
    const Wake wake = next_branch();
    if (!decided) for_each(1, DecidePass{wake, flag});
    next_ = {};
    cudaStreamCaptureStatus capturing;
    cudaGraph_t graph = nullptr;
    const cudaGraphNode_t* before = nullptr;
    std::size_t count = 0;
    CUDA_CHECK(cudaStreamGetCaptureInfo(stream_, &capturing, nullptr, &graph, &before, nullptr,
                                        &count));
    cudaGraphNodeParams parameters{};
    parameters.type = cudaGraphNodeTypeConditional;
    parameters.conditional.handle = wake.branch;
    parameters.conditional.type = cudaGraphCondTypeIf;
    parameters.conditional.size = 1;
    cudaGraphNode_t node = nullptr;
    CUDA_CHECK(cudaGraphAddNode(&node, graph, before, nullptr, count, &parameters));
    CUDA_CHECK(cudaStreamUpdateCaptureDependencies(stream_, &node, nullptr, 1,
                                                   cudaStreamSetCaptureDependencies));
    capture_into(parameters.conditional.phGraph_out[0], then);
  }
  /// While recording: what wakes the branch of the next `when`. Whoever sets its flag must call it, and
  /// then nothing looks at the flag any more.
  Wake next_branch() {
    if (next_.branch || !recording()) return next_;
    cudaStreamCaptureStatus capturing;
    cudaGraph_t graph = nullptr;
    CUDA_CHECK(cudaStreamGetCaptureInfo(stream_, &capturing, nullptr, &graph, nullptr, nullptr,
                                        nullptr));
    CUDA_CHECK(cudaGraphConditionalHandleCreate(&next_.branch, graph, 0, cudaGraphCondAssignDefault));
    return next_;
  }

  /// The passes as a graph of their own; none of them runs.
  template <class Passes>
  cudaGraph_t capture(Passes passes) {
    cudaGraph_t graph = nullptr;
    CUDA_CHECK(cudaStreamBeginCapture(recorded_, cudaStreamCaptureModeThreadLocal));
    std::swap(stream_, recorded_);
    next_ = {};
    passes();
    next_ = {};
    std::swap(stream_, recorded_);
    CUDA_CHECK(cudaStreamEndCapture(recorded_, &graph));
    return graph;
  }

  /// What `find` says of a kernel the first time, ever after.
  template <class Find>
  int remembered(const void* kernel, Find find) {
    const auto known = found_.find(kernel);
    return known != found_.end() ? known->second : found_.emplace(kernel, find()).first->second;
  }

  /// Whether what is asked for is put down and not done.
  bool recording() const { return stream_ != own_stream; }
  void wait() { CUDA_CHECK(cudaStreamSynchronize(stream_)); }
  cudaStream_t stream() const { return stream_; }

 private:
  /// So that loading one small problem after the other does not go to the driver for each array.
  static void keep_freed_memory() {
    int device = 0;
    cudaMemPool_t pool = nullptr;
    std::uint64_t kept = 256u << 20;
    CUDA_CHECK(cudaGetDevice(&device));
    CUDA_CHECK(cudaDeviceGetDefaultMemPool(&pool, device));
    CUDA_CHECK(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &kept));
  }

  template <class Body>
  void capture_into(cudaGraph_t graph, Body body) {
    CUDA_CHECK(cudaStreamBeginCaptureToGraph(inner_, graph, nullptr, nullptr, 0,
                                             cudaStreamCaptureModeThreadLocal));
    std::swap(stream_, inner_);
    body();
    std::swap(stream_, inner_);
    CUDA_CHECK(cudaStreamEndCapture(inner_, &graph));
  }

  cudaStream_t stream_ = own_stream, recorded_ = nullptr, inner_ = nullptr;
  std::map<const void*, int> found_;
  Wake next_;
};

/// A sequence of passes, kept to be run again and again.
class Recording {
 public:
  Recording() = default;
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  ~Recording() { clear(); }

  template <class Passes>
  void record(Queue& queue, Passes passes) {
    clear();
    const cudaGraph_t graph = queue.capture(passes);
    const cudaError_t error = cudaGraphInstantiate(&executable_, graph, 0);
    cudaGraphDestroy(graph);
    CUDA_CHECK(error);
  }
  bool recorded() const { return executable_ != nullptr; }
  void replay(Queue& queue) { CUDA_CHECK(cudaGraphLaunch(executable_, queue.stream())); }
  void clear() {
    if (executable_) cudaGraphExecDestroy(executable_);
    executable_ = nullptr;
  }

 private:
  cudaGraphExec_t executable_ = nullptr;
};

/// Seconds between laps on the device, by events, since `start`, which may come again and again;
/// `read` waits for the device and adds up.
class Stopwatch {
 public:
  ~Stopwatch() {
    for (auto e : events_) cudaEventDestroy(e);
  }
  void start(Queue& queue) {
    if (used_ > 0) laps_.push_back(nullptr);
    record(queue);
  }
  void lap(Queue& queue, StageTimes::Stage& stage) {
    laps_.push_back(&stage);
    record(queue);
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
  void record(Queue& queue) {
    if (used_ == events_.size()) {
      events_.emplace_back();
      CUDA_CHECK(cudaEventCreate(&events_.back()));
    }
    CUDA_CHECK(cudaEventRecord(events_[used_++], queue.stream()));
  }
  std::vector<cudaEvent_t> events_;
  std::vector<StageTimes::Stage*> laps_;
  std::size_t used_ = 0;
};

#else

struct Wake {
  void operator()() const {}
};

/// Passes in order; each has ended when its call returns.
class Queue {
 public:
  template <class Body>
  void for_each(int n, Body body) {
    if (n <= 0) return;
    thrust::for_each(thrust::omp::par, thrust::counting_iterator<int>(0),
                     thrust::counting_iterator<int>(n), body);
  }
  template <class Body>
  void for_each_tile_team(int n, Body body) {
    for_each(n, [body](int i) {
      TileTeam team(i);
      body(team);
    });
  }
  template <int lanes, class Body>
  void for_each_group(int n, Body body) {
    for_each(n, [body](int i) {
      Group<1> group(i);
      body(group);
    });
  }
  void fill_zero(void* p, std::size_t bytes) {
    if (bytes) std::memset(p, 0, bytes);
  }
  void copy(void* to, const void* from, std::size_t bytes) {
    if (bytes) std::memcpy(to, from, bytes);
  }
  void exclusive_scan(const int* in, int* out, int n, Buffer<char>&) {
    thrust::exclusive_scan(thrust::omp::par, in, in + n, out);
  }
  static void reserve_scan(int, Buffer<char>&) {}
  void sort_by_key(int* keys, int* values, int n) {
    thrust::stable_sort_by_key(thrust::omp::par, keys, keys + n, values);
  }
  void lower_bounds(const int* keys, int n, int* out, int count) {
    thrust::lower_bound(thrust::omp::par, keys, keys + n, thrust::counting_iterator<int>(0),
                        thrust::counting_iterator<int>(count), out);
  }
  template <class Then>
  void when(const int* flag, Then then) {
    if (*flag != 0) then();
  }
  Wake next_branch() { return {}; }
  void wait() {}
};

class Recording {
 public:
  template <class Passes>
  void record(Queue&, Passes passes) {
    passes_ = passes;
  }
  bool recorded() const { return static_cast<bool>(passes_); }
  void replay(Queue&) { passes_(); }
  void clear() { passes_ = nullptr; }

 private:
  std::function<void()> passes_;
};

/// Seconds between laps, by the wall clock.
class Stopwatch {
 public:
  void start(Queue&) { last_ = std::chrono::steady_clock::now(); }
  void lap(Queue&, StageTimes::Stage& stage) {
    const auto now = std::chrono::steady_clock::now();
    stage.seconds += std::chrono::duration<double>(now - last_).count();
    ++stage.calls;
    last_ = now;
  }
  void read() {}

 private:
  std::chrono::steady_clock::time_point last_;
};

#endif

}  // namespace decant::gpu::DECANT_EXECUTOR
