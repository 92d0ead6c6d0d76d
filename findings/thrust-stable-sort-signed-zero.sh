#!/usr/bin/env bash
# Thrust: stable_sort_by_key of float keys is not stable on the CPU, and the order depends on the thread count.
#
# Seen with   nvidia-cuda-cccl 13.3.5.0.6 (PyPI wheel, Thrust 3.5.0), g++ 12.2; the same with Thrust 3.0.1 (CUDA 13.0)
#             and 1.17.2 (Debian 12).
# Behavior    For float and double keys under operator< the sequential and OpenMP back ends sort by the bits, in
#             which -0.0 comes before +0.0, although neither is less than the other. Equal keys so change
#             their order. With OpenMP each thread's part is sorted by bits and the parts are merged by
#             operator<, so that the result is neither order and changes with the number of threads. Any
#             comparison that the library does not know (a lambda with the same `<`) keeps the promise.
#             CUB, which does the same job on the GPU, documents that it takes both zeros as equal.
# Output seen keys +0 -0 +0 -0 1, values 0..4: host 1 3 0 2 4; OpenMP with 1 thread 1 3 0 2 4, with 2 threads
#             1 0 2 3 4; lambda and std::stable_sort 0 1 2 3 4.
# Why         Fluids at rest and plane starts have components of both zeros. Particles sorted by a coordinate
#             get another order on CPU and GPU and by thread count, and with it other sums in every list.
#             Adding +0.0f to the key (under strict arithmetic) or an integer key removes it.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --no-compile --disable-pip-version-check --only-binary=:all: \
    --no-deps nvidia-cuda-cccl==13.3.5.0.6
headers=$(dirname "$(find "$dir/venv" -type d -path '*include/cccl/thrust' -print -quit)")
cat >"$dir/order.cpp" <<'CPP'
#include <thrust/execution_policy.h>
#include <thrust/sort.h>
#include <thrust/system/omp/execution_policy.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

const std::vector<float> keys{0.0f, -0.0f, 0.0f, -0.0f, 1.0f};

template <class Sort>
void show(const char* name, Sort sort) {
    std::vector<float> k = keys;
    std::vector<int> v{0, 1, 2, 3, 4};
    sort(k, v);
    std::string out;
    for (int i : v) out += " " + std::to_string(i);
    std::printf("%s:%s\n", name, out.c_str());
}

int main() {
    const auto less = [](float a, float b) { return a < b; };
    show("host", [](auto& k, auto& v) { thrust::stable_sort_by_key(thrust::host, k.begin(), k.end(), v.begin()); });
    show("omp", [](auto& k, auto& v) { thrust::stable_sort_by_key(thrust::omp::par, k.begin(), k.end(), v.begin()); });
    show("host lambda", [&](auto& k, auto& v) {
        thrust::stable_sort_by_key(thrust::host, k.begin(), k.end(), v.begin(), less);
    });
    show("std", [&](auto& k, auto& v) {
        std::stable_sort(v.begin(), v.end(), [&](int a, int b) { return less(k[a], k[b]); });
    });
}
CPP
g++ -std=c++17 -O1 -fopenmp -DTHRUST_DEVICE_SYSTEM=THRUST_DEVICE_SYSTEM_OMP -isystem "$headers" \
    "$dir/order.cpp" -o "$dir/order"
for threads in 1 2; do
    echo "$threads thread(s)"
    OMP_NUM_THREADS=$threads OMP_DYNAMIC=false "$dir/order" | tee "$dir/$threads"
    grep -qx 'host: 1 3 0 2 4' "$dir/$threads"
    grep -qx 'host lambda: 0 1 2 3 4' "$dir/$threads"
    grep -qx 'std: 0 1 2 3 4' "$dir/$threads"
done
grep -qx 'omp: 1 3 0 2 4' "$dir/1"
grep -qx 'omp: 1 0 2 3 4' "$dir/2"
