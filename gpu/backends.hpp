/// \file
/// The table of backends under test.
#pragma once

#include "oracle/backend.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace decant {

namespace gpu {
class DeviceSolver;
}

enum class Executor { host, cuda };

/// Names in the table: "brute", …
std::vector<std::string> backend_names();

/// Whether this build has the executor and this machine a device for it; `why_not` says what is
/// missing, in a few words.
bool executor_available(Executor executor, std::string* why_not = nullptr);

/// What the executor runs on: "NVIDIA H200, driver 13.0, sm_90" or "8 OpenMP threads".
std::string executor_device(Executor executor);

/// From here on a profiler that waits for it looks at kernels; without CUDA nothing happens.
void start_profiler();

/// Of the host executor: "2.3.1".
std::string thrust_version();

/// The host side around any solver of an executor: for one that is not in the table.
std::unique_ptr<Backend> backend_around(std::string name, Executor executor, std::string options,
                                        std::unique_ptr<gpu::DeviceSolver> solver);

/// Throws InputError for an unknown name or option, BackendError where the executor is missing.
std::unique_ptr<Backend> make_backend(std::string_view name, Executor executor, const std::string& options = {});

}  // namespace decant
