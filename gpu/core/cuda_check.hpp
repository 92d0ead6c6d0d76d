/// \file
/// CUDA errors become exceptions with the failed expression and where it stands.
#pragma once

#include "reference/error.hpp"

#include <cuda_runtime.h>

#include <string>

#define CUDA_CHECK(expression)                                                                                      \
  do {                                                                                                              \
    const cudaError_t decant_cuda_error = (expression);                                                             \
    if (decant_cuda_error != cudaSuccess)                                                                           \
      throw ::decant::BackendError(std::string(#expression) + ": " + cudaGetErrorString(decant_cuda_error) + " (" + \
                                   __FILE__ + ":" + std::to_string(__LINE__) + ")");                                \
  } while (false)
