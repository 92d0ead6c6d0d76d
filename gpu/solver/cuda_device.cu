/// \file
/// What the CUDA executor runs on.
#include "gpu/core/cuda_check.hpp"
#include "gpu/solver/device_solver.hpp"

#include <cuda_profiler_api.h>

namespace decant::gpu::cuda {

std::string device(std::string* why_not) {
  int count = 0;
  cudaError_t error = cudaGetDeviceCount(&count);
  cudaDeviceProp properties{};
  if (error == cudaSuccess && count > 0) error = cudaGetDeviceProperties(&properties, 0);
  if (error != cudaSuccess || count == 0) {
    if (why_not) *why_not = error != cudaSuccess ? cudaGetErrorString(error) : "no CUDA device";
    cudaGetLastError();  // the next call starts clean
    return {};
  }
  int driver = 0;
  CUDA_CHECK(cudaDriverGetVersion(&driver));
  return std::string(properties.name) + ", CUDA driver " + std::to_string(driver / 1000) + "." +
         std::to_string(driver % 1000 / 10) + ", sm_" + std::to_string(properties.major) +
         std::to_string(properties.minor);
}

void use_device(int rank) {
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) {
    cudaGetLastError();  // the ranks of the other executor need none
    return;
  }
  CUDA_CHECK(cudaSetDevice(rank % count));
}

void start_profiler() { CUDA_CHECK(cudaProfilerStart()); }

}  // namespace decant::gpu::cuda
