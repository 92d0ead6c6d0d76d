/// \file
/// Every backend on the host executor: Thrust's OpenMP device system, g++.
#include "gpu/brute_force.cuh"
#include "gpu/device_solver.hpp"
#include "gpu/grid_search.cuh"

#include <omp.h>
#include <thrust/version.h>

namespace decant::gpu::host {

std::unique_ptr<DeviceSolver> make_brute(const SolverOptions& options) {
  return std::make_unique<Pipeline<BruteSearch>>(options);
}
std::unique_ptr<DeviceSolver> make_hash(const SolverOptions& options) {
  return std::make_unique<Pipeline<HashSearch>>(options);
}
std::unique_ptr<DeviceSolver> make_list(const SolverOptions& options) {
  return std::make_unique<Pipeline<ListSearch>>(options);
}

std::string device() {
  const int threads = omp_get_max_threads();
  return std::to_string(threads) + (threads == 1 ? " OpenMP thread" : " OpenMP threads");
}

std::string thrust_version() {
  return std::to_string(THRUST_MAJOR_VERSION) + "." + std::to_string(THRUST_MINOR_VERSION) + "." +
         std::to_string(THRUST_SUBMINOR_VERSION);
}

}  // namespace decant::gpu::host
