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
class Communicator;
class DeviceSolver;
class RankTeam;
}  // namespace gpu

enum class Executor { host, cuda };

/// The processes that mpirun started with this one. While rank 0's lives, backends that have the option `ranks` run
/// on all of them.
/// Where there is one process nothing changes.
class ProcessRanks {
 public:
  /// Throws BackendError where the processes cannot find each other.
  ProcessRanks();
  /// The other ranks end with rank 0's.
  ~ProcessRanks();
  ProcessRanks(const ProcessRanks&) = delete;
  ProcessRanks& operator=(const ProcessRanks&) = delete;

  /// Of a rank that is not 0: does what rank 0 asks until that ends, and then returns true. False elsewhere.
  bool serve();

 private:
  std::unique_ptr<gpu::Communicator> others_;
  std::shared_ptr<gpu::RankTeam> team_;
};

/// "Open MPI 4.1.4" and "2.28.3", or "none".
std::string mpi_version();
std::string nccl_version();

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
