/// \file
/// Every backend on the executor that includes this.
#pragma once

#include "gpu/brute_force.cuh"
#include "gpu/device_solver.hpp"
#include "gpu/grid_search.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

std::unique_ptr<DeviceSolver> make_brute(const SolverOptions& options) {
  return std::make_unique<Pipeline<BruteSearch>>(options);
}
std::unique_ptr<DeviceSolver> make_hash(const SolverOptions& options) {
  return std::make_unique<Pipeline<HashSearch>>(options);
}
std::unique_ptr<DeviceSolver> make_list(const SolverOptions& options) {
  return std::make_unique<Pipeline<ListSearch>>(options);
}

}  // namespace decant::gpu::DECANT_EXECUTOR
