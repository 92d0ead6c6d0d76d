/// \file
/// Exchange between the memories of GPUs without the host in between, by NCCL.
#pragma once

#include "gpu/ranks/communicator.hpp"

#include <memory>
#include <string>

namespace decant::gpu::cuda {

/// Of the calling thread's device. Null on all ranks where NCCL cannot serve them: it is not in this build, or two
/// of them share a device. Throws BackendError where NCCL fails. All ranks call it together.
std::unique_ptr<DeviceExchange> make_nccl_exchange(Communicator& ranks);

/// "2.28.3", or "none".
std::string nccl_version();

}  // namespace decant::gpu::cuda
