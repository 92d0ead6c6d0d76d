#!/usr/bin/env bash
# CUDA: cudaStreamBeginCapture takes 200 times longer while other threads use their own streams.
#
# Seen with   nvidia-cuda-runtime 13.0.96 (PyPI wheel), driver 580.159, one H200, 16 cores.
# Behavior    Sixteen threads, each with a stream of its own, put memsets into it and wait for it. A thread that
#             captures ten memsets on another stream of its own, in whichever mode, waits for half a millisecond in
#             cudaStreamBeginCapture. Putting the same ten memsets into a graph with cudaGraphAddMemsetNode does not
#             wait. cudaStreamCaptureModeThreadLocal and Relaxed keep other threads' calls legal, not out of the way.
# Output seen  1 threads: by nodes 2.2 us, captured 2.5 us, captured in relaxed mode 2.5 us
#             16 threads: by nodes 7.9 us, captured 530.0 us, captured in relaxed mode 509.4 us
# Why         Tests and parameter studies run many small problems by many threads on one device, and capture graphs
#             because launches are slow. There capturing costs more than the launches that it saves.
set -euo pipefail
command -v nvidia-smi >/dev/null && nvidia-smi -L | grep -q GPU || { echo "needs an NVIDIA GPU"; exit 77; }
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: --no-deps \
    nvidia-cuda-runtime==13.0.96 nvidia-cuda-crt==13.0.88
include=$(dirname "$(find "$dir/venv" -name cuda_runtime_api.h -print -quit)")
library=$(find "$dir/venv" -name 'libcudart.so.13' -print -quit)
cat >"$dir/capture.cpp" <<'CPP'
#include <cuda_runtime_api.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

void check(cudaError_t error) {
    if (error == cudaSuccess) return;
    std::printf("%s\n", cudaGetErrorString(error));
    std::exit(1);
}

constexpr int rounds = 200, nodes = 10;

/// Median time of a round's capture, or of the same graph by nodes, in microseconds.
double median(int threads, bool captures, cudaStreamCaptureMode mode) {
    std::vector<std::vector<double>> times(threads);
    std::vector<std::thread> all;
    for (int t = 0; t < threads; ++t)
        all.emplace_back([&, t] {
            cudaStream_t busy, captured;
            check(cudaStreamCreateWithFlags(&busy, cudaStreamNonBlocking));
            check(cudaStreamCreateWithFlags(&captured, cudaStreamNonBlocking));
            void* memory;
            check(cudaMalloc(&memory, 4096));
            for (int r = 0; r < rounds; ++r) {
                for (int k = 0; k < 20; ++k) check(cudaMemsetAsync(memory, k, 4096, busy));
                const auto start = std::chrono::steady_clock::now();
                cudaGraph_t graph;
                if (captures) {
                    check(cudaStreamBeginCapture(captured, mode));
                    for (int k = 0; k < nodes; ++k) check(cudaMemsetAsync(memory, k, 4096, captured));
                    check(cudaStreamEndCapture(captured, &graph));
                } else {
                    check(cudaGraphCreate(&graph, 0));
                    cudaGraphNode_t last = nullptr;
                    for (int k = 0; k < nodes; ++k) {
                        cudaMemsetParams p{};
                        p.dst = memory;
                        p.value = k;
                        p.elementSize = 1;
                        p.width = 4096;
                        p.height = 1;
                        cudaGraphNode_t node;
                        check(cudaGraphAddMemsetNode(&node, graph, last ? &last : nullptr, last ? 1 : 0, &p));
                        last = node;
                    }
                }
                times[t].push_back(
                    std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
                check(cudaGraphDestroy(graph));
                check(cudaStreamSynchronize(busy));
            }
        });
    std::vector<double> every;
    for (int t = 0; t < threads; ++t) {
        all[t].join();
        every.insert(every.end(), times[t].begin(), times[t].end());
    }
    std::nth_element(every.begin(), every.begin() + every.size() / 2, every.end());
    return every[every.size() / 2];
}

int main() {
    check(cudaFree(nullptr));
    double of_capture[2], of_nodes[2];
    for (int k = 0; k < 2; ++k) {
        const int threads = k == 0 ? 1 : 16;
        of_nodes[k] = median(threads, false, cudaStreamCaptureModeRelaxed);
        of_capture[k] = median(threads, true, cudaStreamCaptureModeThreadLocal);
        std::printf("%2d threads: by nodes %.1f us, captured %.1f us, captured in relaxed mode %.1f us\n", threads,
                    of_nodes[k], of_capture[k], median(threads, true, cudaStreamCaptureModeRelaxed));
    }
    const bool waits = of_capture[1] > 20 * of_capture[0] && of_capture[1] > 10 * of_nodes[1];
    std::printf("%s\n", waits ? "capturing waits for the others" : "capturing does not wait for the others");
    return waits ? 0 : 1;
}
CPP
g++ -std=c++17 -O2 -pthread -I"$include" "$dir/capture.cpp" "$library" -Wl,-rpath,"$(dirname "$library")" -o "$dir/capture"
"$dir/capture"
