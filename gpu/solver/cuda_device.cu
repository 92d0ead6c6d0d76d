/// \file
/// What the CUDA executor runs on.
#include "gpu/core/cuda_check.hpp"
#include "gpu/solver/device_solver.hpp"

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

}  // namespace decant::gpu::cuda
