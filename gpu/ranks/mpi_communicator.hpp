/// \file
/// Ranks that are the processes of one mpirun.
#pragma once

#include "gpu/ranks/communicator.hpp"

#include <memory>
#include <string>

namespace decant::gpu {

/// Of this process among those that mpirun, or srun, started, in which MPI begins with this call and ends with the
/// communicator. Null where there is one process, or none was started that way, or this build has no MPI.
/// Throws BackendError where several processes were started and this build has no MPI.
std::unique_ptr<Communicator> mpi_communicator();

/// This process's number among those on its machine; 0 where it is the only one.
int rank_on_this_machine(Communicator& ranks);

/// "Open MPI 4.1.4", or "none".
std::string mpi_version();

}  // namespace decant::gpu
