/// \file
/// Thrust's and CUB's algorithms on device arrays, in a translation unit of their own: their headers take longer to
/// compile than the backends.
#pragma once

#include <cstddef>

namespace decant::gpu {

/// Pairs of a key and a value, and room for as many.
struct Pairs {
  int *key, *other_key, *value, *other_value;
};

namespace host {
/// out[k] = in[0] + … + in[k−1], k < n. No scratch memory is needed.
void exclusive_scan(const int* in, int* out, int n);
/// Stable.
void sort_by_key(int* keys, int* values, int n);
/// Stable, of keys in 0 … 2^bits − 1; `key` and `value` are the sorted ones afterwards.
void sort_pairs(Pairs& pairs, int n, int bits);
/// out[k] = how many of the sorted keys are below k, k < count.
void lower_bounds(const int* keys, int n, int* out, int count);
}  // namespace host

namespace cuda {
/// The same on a stream (a cudaStream_t); `scratch` holds scan_bytes(n) bytes. Throws BackendError.
void exclusive_scan(const int* in, int* out, int n, void* scratch, std::size_t bytes, void* stream);
std::size_t scan_bytes(int n);
/// Allocates, so it cannot be captured in a graph.
void sort_by_key(int* keys, int* values, int n, void* stream);
/// `scratch` holds sort_bytes(n, bits) bytes, which are few.
void sort_pairs(Pairs& pairs, int n, int bits, void* scratch, std::size_t bytes, void* stream);
std::size_t sort_bytes(int n, int bits);
void lower_bounds(const int* keys, int n, int* out, int count, void* stream);
}  // namespace cuda

}  // namespace decant::gpu
