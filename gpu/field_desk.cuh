/// \file
/// Device memory that an evaluation writes its fields to, and their way to the host.
#pragma once

#include "gpu/arrays.cuh"
#include "gpu/device_solver.hpp"

namespace decant::gpu::DECANT_EXECUTOR {

template <class T>
T* cut(const Buffer<char>& from, std::size_t& at, std::size_t count) {
  T* p = reinterpret_cast<T*>(from.get() + at);
  at += count * sizeof(T);
  return p;
}

class FieldDesk {
 public:
  /// Of n particles. What no pass writes after this reads as NaN or −1.
  FieldArrays unwritten(int n) {
    n_ = static_cast<std::size_t>(n);
    room_.resize(n_ * bytes);
    return arrays();
  }
  void clear() { room_.resize(0); }
  void download(HostFields& out) const {
    const FieldArrays f = arrays();
    out.density = values(f.density, n_);
    out.pressure = values(f.pressure, n_);
    out.pressure_acceleration = values(f.pressure_acceleration, 3 * n_);
    out.viscous_acceleration = values(f.viscous_acceleration, 3 * n_);
    out.wall_pressure_acceleration = values(f.wall_pressure_acceleration, 3 * n_);
    out.wall_viscous_acceleration = values(f.wall_viscous_acceleration, 3 * n_);
    out.acceleration = values(f.acceleration, 3 * n_);
    const auto wide = [](const auto& all) {
      return std::vector<std::int64_t>(all.begin(), all.end());
    };
    out.fluid_count = wide(values(f.fluid_count, n_));
    out.fluid_id_sum = wide(values(f.fluid_id_sum, n_));
    out.wall_count = wide(values(f.wall_count, n_));
    out.wall_id_sum = wide(values(f.wall_id_sum, n_));
  }

 private:
  static constexpr std::size_t bytes = 2 * 8 + 15 * 4 + 4 * 4;  // a particle

  FieldArrays arrays() const {
    std::size_t at = 0;
    FieldArrays f{};
    f.fluid_id_sum = cut<long long>(room_, at, n_);
    f.wall_id_sum = cut<long long>(room_, at, n_);
    f.pressure_acceleration = cut<float>(room_, at, 3 * n_);
    f.viscous_acceleration = cut<float>(room_, at, 3 * n_);
    f.wall_pressure_acceleration = cut<float>(room_, at, 3 * n_);
    f.wall_viscous_acceleration = cut<float>(room_, at, 3 * n_);
    f.acceleration = cut<float>(room_, at, 3 * n_);
    f.density = cut<float>(room_, at, n_);
    f.pressure = cut<float>(room_, at, n_);
    f.fluid_count = cut<int>(room_, at, n_);
    f.wall_count = cut<int>(room_, at, n_);
    return f;
  }
  template <class T>
  std::vector<T> values(const T* at, std::size_t count) const {
    std::vector<T> all(count);
    room_.download_bytes(all.data(), at, count * sizeof(T));
    return all;
  }

  std::size_t n_ = 0;
  Buffer<char> room_;
};

}  // namespace decant::gpu::DECANT_EXECUTOR
