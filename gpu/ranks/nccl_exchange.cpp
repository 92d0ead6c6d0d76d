/// \file
/// NCCL, where the build has it: sends and receives between pairs of ranks, grouped.
#include "gpu/ranks/nccl_exchange.hpp"

#include "gpu/core/cuda_check.hpp"

#if DECANT_HAS_NCCL
#include <nccl.h>

#include <cstring>
#endif

namespace decant::gpu::cuda {

#if DECANT_HAS_NCCL
namespace {

void check(ncclResult_t result, const char* call) {
  if (result != ncclSuccess) throw BackendError(std::string(call) + ": " + ncclGetErrorString(result));
}
#define NCCL_CHECK(call) check(call, #call)

class NcclExchange : public DeviceExchange {
 public:
  NcclExchange(Communicator& ranks, const ncclUniqueId& id) {
    NCCL_CHECK(ncclCommInitRank(&nccl_, ranks.size(), id, ranks.rank()));
  }
  NcclExchange(const NcclExchange&) = delete;
  NcclExchange& operator=(const NcclExchange&) = delete;
  ~NcclExchange() override { ncclCommDestroy(nccl_); }

  void exchange(std::span<const Segment> send, std::span<const Segment> receive, void* stream) override {
    const auto on = static_cast<cudaStream_t>(stream);
    NCCL_CHECK(ncclGroupStart());
    for (std::size_t k = 0; k < send.size(); ++k) {
      const int rank = static_cast<int>(k);
      if (send[k].bytes > 0) NCCL_CHECK(ncclSend(send[k].data, send[k].bytes, ncclChar, rank, nccl_, on));
      if (receive[k].bytes > 0) NCCL_CHECK(ncclRecv(receive[k].data, receive[k].bytes, ncclChar, rank, nccl_, on));
    }
    NCCL_CHECK(ncclGroupEnd());
  }

 private:
  ncclComm_t nccl_ = nullptr;
};

/// Tells one GPU of the world from another.
struct DeviceId {
  char bytes[16];
};
DeviceId device_id() {
  int device = 0;
  cudaDeviceProp properties{};
  CUDA_CHECK(cudaGetDevice(&device));
  CUDA_CHECK(cudaGetDeviceProperties(&properties, device));
  DeviceId id{};
  std::memcpy(id.bytes, properties.uuid.bytes, sizeof id.bytes);
  return id;
}

}  // namespace

std::unique_ptr<DeviceExchange> make_nccl_exchange(Communicator& ranks) {
  const std::vector<DeviceId> devices = ranks.all(device_id());
  for (std::size_t a = 0; a < devices.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (std::memcmp(&devices[a], &devices[b], sizeof(DeviceId)) == 0) return nullptr;
  ncclUniqueId id{};
  if (ranks.rank() == 0) NCCL_CHECK(ncclGetUniqueId(&id));
  return std::make_unique<NcclExchange>(ranks, ranks.all(id)[0]);
}

std::string nccl_version() {
  int number = 0;
  ncclGetVersion(&number);
  return std::to_string(number / 10000) + "." + std::to_string(number / 100 % 100) + "." + std::to_string(number % 100);
}

#else

std::unique_ptr<DeviceExchange> make_nccl_exchange(Communicator&) { return nullptr; }
std::string nccl_version() { return "none"; }

#endif

}  // namespace decant::gpu::cuda
