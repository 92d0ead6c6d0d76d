/// \file
/// Every backend on the executor that includes this.
#pragma once

#include "gpu/brute_force.cuh"
#include "gpu/device_solver.hpp"
#include "gpu/grid_search.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

#define DECANT_MAKE(name, Search)                                                  \
  std::unique_ptr<DeviceSolver> make_##name(const SolverOptions& options) {        \
    return std::make_unique<Pipeline<Search>>(options);                            \
  }
DECANT_BACKENDS(DECANT_MAKE)
#undef DECANT_MAKE

}  // namespace decant::gpu::DECANT_EXECUTOR
