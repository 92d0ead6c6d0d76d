/// \file
/// What the host executor runs on: Thrust's OpenMP device system.
#include "gpu/solver/device_solver.hpp"

#include <omp.h>
#include <thrust/version.h>

namespace decant::gpu::host {

std::string device() {
  const int threads = omp_get_max_threads();
  return std::to_string(threads) + (threads == 1 ? " OpenMP thread" : " OpenMP threads");
}

std::string thrust_version() {
  return std::to_string(THRUST_MAJOR_VERSION) + "." + std::to_string(THRUST_MINOR_VERSION) + "." +
         std::to_string(THRUST_SUBMINOR_VERSION);
}

}  // namespace decant::gpu::host
