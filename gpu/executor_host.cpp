/// \file
/// Every backend on the host executor: Thrust's OpenMP device system, g++.
#include "gpu/brute_force.cuh"
#include "gpu/device_solver.hpp"

#include <omp.h>

namespace decant::gpu::host {

std::unique_ptr<DeviceSolver> make_brute() { return std::make_unique<Pipeline<BruteSearch>>(); }

std::string device() {
  const int threads = omp_get_max_threads();
  return std::to_string(threads) + (threads == 1 ? " OpenMP thread" : " OpenMP threads");
}

}  // namespace decant::gpu::host
