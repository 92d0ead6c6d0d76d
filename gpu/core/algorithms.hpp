/// \file
/// Thrust's and CUB's algorithms on device arrays, in a translation unit of their own: their headers take longer to
/// compile than the backends.
#pragma once

#include <cstddef>

namespace decant::gpu {

namespace host {
/// out[k] = in[0] + … + in[k−1], k < n. No scratch memory is needed.
void exclusive_scan(const int* in, int* out, int n);
/// Stable.
void sort_by_key(int* keys, int* values, int n);
/// out[k] = how many of the sorted keys are below k, k < count.
void lower_bounds(const int* keys, int n, int* out, int count);
}  // namespace host

namespace cuda {
/// The same on a stream (a cudaStream_t); `scratch` holds scan_bytes(n) bytes. Throws BackendError.
void exclusive_scan(const int* in, int* out, int n, void* scratch, std::size_t bytes, void* stream);
std::size_t scan_bytes(int n);
/// Allocates, so it cannot be captured in a graph.
void sort_by_key(int* keys, int* values, int n, void* stream);
void lower_bounds(const int* keys, int n, int* out, int count, void* stream);
}  // namespace cuda

}  // namespace decant::gpu
