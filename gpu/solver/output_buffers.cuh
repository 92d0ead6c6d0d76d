/// \file
/// Device memory that an evaluation writes its fields to, and their way to the host.
#pragma once

#include "gpu/core/buffer.cuh"
#include "gpu/core/particle_arrays.cuh"
#include "gpu/solver/device_solver.hpp"

#include <cstring>
#include <vector>

namespace decant::gpu {
namespace {

class OutputBuffers {
 public:
  /// Of n particles; `all`, or density and pressure alone. What no kernel writes after this reads as NaN or −1.
  OutputArrays unwritten(int n, bool all) {
    n_ = static_cast<std::size_t>(n);
    all_ = all;
    memory_.resize(n_ * (all ? bytes : density_bytes));
    return arrays();
  }
  void clear() { memory_.resize(0); }
  void download(HostFields& out) {
    // Of few particles all at once: a copy waits for the device.
    at_once_ = memory_.bytes() <= most_at_once ? host_.download(memory_.get(), memory_.bytes()) : nullptr;
    const OutputArrays f = arrays();
    out.density = values(f.density, n_);
    out.pressure = values(f.pressure, n_);
    if (!all_) return;
    out.pressure_acceleration = values(f.pressure_acceleration, 3 * n_);
    out.viscous_acceleration = values(f.viscous_acceleration, 3 * n_);
    out.wall_pressure_acceleration = values(f.wall_pressure_acceleration, 3 * n_);
    out.wall_viscous_acceleration = values(f.wall_viscous_acceleration, 3 * n_);
    out.acceleration = values(f.acceleration, 3 * n_);
    const auto wide = [](const auto& all) { return std::vector<std::int64_t>(all.begin(), all.end()); };
    out.fluid_count = wide(values(f.fluid_count, n_));
    out.fluid_id_sum = wide(values(f.fluid_id_sum, n_));
    out.wall_count = wide(values(f.wall_count, n_));
    out.wall_id_sum = wide(values(f.wall_id_sum, n_));
  }

 private:
  static constexpr std::size_t density_bytes = 2 * 4, bytes = density_bytes + 2 * 8 + 15 * 4 + 2 * 4;  // per particle

  OutputArrays arrays() const {
    std::size_t at = 0;
    OutputArrays f{};
    f.density = carve<float>(memory_, at, n_);
    f.pressure = carve<float>(memory_, at, n_);
    if (!all_) return f;
    f.fluid_id_sum = carve<long long>(memory_, at, n_);
    f.wall_id_sum = carve<long long>(memory_, at, n_);
    f.pressure_acceleration = carve<float>(memory_, at, 3 * n_);
    f.viscous_acceleration = carve<float>(memory_, at, 3 * n_);
    f.wall_pressure_acceleration = carve<float>(memory_, at, 3 * n_);
    f.wall_viscous_acceleration = carve<float>(memory_, at, 3 * n_);
    f.acceleration = carve<float>(memory_, at, 3 * n_);
    f.fluid_count = carve<int>(memory_, at, n_);
    f.wall_count = carve<int>(memory_, at, n_);
    return f;
  }
  template <class T>
  std::vector<T> values(const T* at, std::size_t count) const {
    std::vector<T> all(count);
    if (count == 0) return all;
    if (!at_once_) memory_.download_bytes(all.data(), at, count * sizeof(T));
    else std::memcpy(all.data(), at_once_ + (reinterpret_cast<const char*>(at) - memory_.get()), count * sizeof(T));
    return all;
  }

  static constexpr std::size_t most_at_once = 1u << 20;

  std::size_t n_ = 0;
  bool all_ = true;
  Buffer<char> memory_;
  PinnedBuffer host_;
  const char* at_once_ = nullptr;  // all of the memory, in `host_`
};

}  // namespace
}  // namespace decant::gpu
