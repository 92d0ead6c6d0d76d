/// \file
/// What an advance or evaluation tells its caller: a device's status as a Status, and those of ranks as one.
#pragma once

#include "gpu/core/device_status.cuh"
#include "oracle/backend.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace decant::gpu {
namespace {

/// The particle by its id on this device, the substep from the beginning of the advance.
inline Status status_of(const DeviceStatus& from) {
  Status status;
  const unsigned long long first = std::min({from.non_finite, from.escaped, from.missed_pair});
  if (from.non_finite != DeviceStatus::none) status.bits |= Status::non_finite;
  if (from.escaped != DeviceStatus::none) status.bits |= Status::escaped;
  if (from.missed_pair != DeviceStatus::none) status.bits |= Status::missed_pair;
  // Nobody grew what was too short: whatever came out of it is not to be used.
  if (from.longest_list != 0 || from.tile_bytes != 0) status.bits |= Status::capacity;
  if (first != DeviceStatus::none) {
    status.particle = static_cast<std::int64_t>(first & 0xFFFFFFFFull);
    status.substep = static_cast<std::int64_t>(first >> 32);
  }
  return status;
}

/// Of all ranks the same one: what came first, of the particle with the smallest id.
inline Status first_of(const std::vector<Status>& ranks) {
  Status first;
  for (const Status& s : ranks) {
    first.bits |= s.bits;
    if (s.particle < 0) continue;
    if (first.particle < 0 || std::pair(s.substep, s.particle) < std::pair(first.substep, first.particle)) {
      first.substep = s.substep;
      first.particle = s.particle;
    }
  }
  return first;
}

}  // namespace
}  // namespace decant::gpu
