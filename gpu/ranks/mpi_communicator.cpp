/// \file
/// MPI, where the build has it. Messages are cut into parts, since MPI counts with ints; who waits for long lets
/// others run, since ranks may be more than cores.
#include "gpu/ranks/mpi_communicator.hpp"

#include "reference/error.hpp"

#include <cstdlib>

#if DECANT_HAS_MPI
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>
#endif

namespace decant::gpu {
namespace {

/// How many processes were started with this one; 1 where nobody says so.
int processes_started() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"})
    if (const char* value = std::getenv(name)) return std::atoi(value);
  if (const char* tasks = std::getenv("SLURM_STEP_NUM_TASKS"); tasks && std::getenv("PMIX_RANK"))
    return std::atoi(tasks);
  return 1;
}

#if DECANT_HAS_MPI

class MpiCommunicator : public Communicator {
 public:
  MpiCommunicator() {
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    if (level < MPI_THREAD_SERIALIZED) {
      MPI_Finalize();
      throw BackendError("this MPI does not let one thread after the other call it (MPI_THREAD_SERIALIZED)");
    }
  }
  ~MpiCommunicator() override {
    if (!failed_) MPI_Finalize();
  }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  void broadcast(Bytes& data) override {
    std::size_t bytes = data.size();
    MPI_Request request{};
    MPI_Ibcast(&bytes, sizeof bytes, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
    // Between requests ranks wait for as long as rank 0 is busy with other things.
    for (int done = 0; MPI_Test(&request, &done, MPI_STATUS_IGNORE), !done;)
      std::this_thread::sleep_for(std::chrono::microseconds(rank_ == 0 ? 0 : 50));
    data.resize(bytes);
    for (std::size_t at = 0; at < bytes; at += part) {
      MPI_Ibcast(data.data() + at, length(bytes - at), MPI_BYTE, 0, MPI_COMM_WORLD, &request);
      wait({&request, 1});
    }
  }
  std::vector<Bytes> gather(const Bytes& own) override {
    std::vector<std::size_t> sizes = all(own.size());
    std::vector<Bytes> gathered;
    std::vector<Segment> send(sizes.size()), receive(sizes.size());
    if (rank_ == 0) {
      for (const std::size_t bytes : sizes) gathered.emplace_back(bytes);
      for (std::size_t k = 1; k < sizes.size(); ++k) receive[k] = {gathered[k].data(), sizes[k]};
      gathered[0] = own;
    } else {
      send[0] = {const_cast<std::byte*>(own.data()), own.size()};
    }
    transfer(send, receive);
    return gathered;
  }
  void all_gather(const void* own, std::size_t bytes, void* all) override {
    MPI_Request request{};
    MPI_Iallgather(own, static_cast<int>(bytes), MPI_BYTE, all, static_cast<int>(bytes), MPI_BYTE, MPI_COMM_WORLD,
                   &request);
    wait({&request, 1});
  }
  void exchange(std::span<const Segment> send, std::span<const Segment> receive) override { transfer(send, receive); }
  void fail(const std::string& why) noexcept override {
    failed_ = true;
    std::fprintf(stderr, "decant: %s\n", why.c_str());
    MPI_Abort(MPI_COMM_WORLD, 3);
  }

 private:
  static constexpr std::size_t part = std::size_t{1} << 30;
  static int length(std::size_t bytes) { return static_cast<int>(std::min(bytes, part)); }

  void transfer(std::span<const Segment> send, std::span<const Segment> receive) {
    std::vector<MPI_Request> requests;
    for (std::size_t k = 0; k < receive.size(); ++k)
      for (std::size_t at = 0; at < receive[k].bytes; at += part)
        MPI_Irecv(static_cast<std::byte*>(receive[k].data) + at, length(receive[k].bytes - at), MPI_BYTE,
                  static_cast<int>(k), 0, MPI_COMM_WORLD, &requests.emplace_back());
    for (std::size_t k = 0; k < send.size(); ++k)
      for (std::size_t at = 0; at < send[k].bytes; at += part)
        MPI_Isend(static_cast<const std::byte*>(send[k].data) + at, length(send[k].bytes - at), MPI_BYTE,
                  static_cast<int>(k), 0, MPI_COMM_WORLD, &requests.emplace_back());
    const std::vector<MPI_Status> statuses = wait(requests);
    // A longer message than expected is an error of MPI's; a shorter one is not.
    std::size_t r = 0;
    for (std::size_t k = 0; k < receive.size(); ++k)
      for (std::size_t at = 0; at < receive[k].bytes; at += part, ++r) {
        int got = 0;
        MPI_Get_count(&statuses[r], MPI_BYTE, &got);
        if (got != length(receive[k].bytes - at))
          throw BackendError("rank " + std::to_string(k) + " sends " + std::to_string(got) + " bytes where rank " +
                             std::to_string(rank_) + " expects " + std::to_string(length(receive[k].bytes - at)));
      }
  }
  static std::vector<MPI_Status> wait(std::span<MPI_Request> requests) {
    std::vector<MPI_Status> statuses(requests.size());
    const int count = static_cast<int>(requests.size());
    for (int done = 0, tries = 0; MPI_Testall(count, requests.data(), &done, statuses.data()), !done; ++tries)
      if (tries > 1000) std::this_thread::yield();
    return statuses;
  }

  int rank_ = 0, size_ = 1;
  bool failed_ = false;
};

#endif

}  // namespace

std::unique_ptr<Communicator> mpi_communicator() {
  if (processes_started() < 2) return nullptr;
#if DECANT_HAS_MPI
  auto ranks = std::make_unique<MpiCommunicator>();
  // Another MPI's mpirun starts processes that do not know of each other.
  if (ranks->size() != processes_started())
    throw BackendError("mpirun started " + std::to_string(processes_started()) + " processes, and " + mpi_version() +
                       ", which this build uses, sees " + std::to_string(ranks->size()));
  return ranks;
#else
  throw BackendError("mpirun started several processes, and this build has no MPI");
#endif
}

int rank_on_this_machine([[maybe_unused]] Communicator& ranks) {
#if DECANT_HAS_MPI
  MPI_Comm here{};
  int rank = 0;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, ranks.rank(), MPI_INFO_NULL, &here);
  MPI_Comm_rank(here, &rank);
  MPI_Comm_free(&here);
  return rank;
#else
  return 0;
#endif
}

std::string mpi_version() {
#if DECANT_HAS_MPI
  char text[MPI_MAX_LIBRARY_VERSION_STRING] = {};
  int length = 0;
  MPI_Get_library_version(text, &length);
  // Open MPI's goes on with who built it where.
  const std::string whole(text);
  std::string version = whole.substr(0, whole.find_first_of(",\n"));
  if (version.starts_with("Open MPI v")) version.erase(9, 1);
  return version;
#else
  return "none";
#endif
}

}  // namespace decant::gpu
