/// \file
/// Rigid motion of containers.
#pragma once

#include "gpu/physics/vectors.cuh"

namespace decant::gpu {
namespace {

/// R x and Rᵀ x.
DECANT_DEVICE Float3 rotate(const DevicePose& p, Float3 x) {
  return {p.R[0] * x.x + p.R[1] * x.y + p.R[2] * x.z, p.R[3] * x.x + p.R[4] * x.y + p.R[5] * x.z,
          p.R[6] * x.x + p.R[7] * x.y + p.R[8] * x.z};
}
DECANT_DEVICE Float3 rotate_back(const DevicePose& p, Float3 x) {
  return {p.R[0] * x.x + p.R[3] * x.y + p.R[6] * x.z, p.R[1] * x.x + p.R[4] * x.y + p.R[7] * x.z,
          p.R[2] * x.x + p.R[5] * x.y + p.R[8] * x.z};
}

/// Velocity of a container's surface at x: omega × (x − pivot) + surface.
DECANT_DEVICE Float3 surface_velocity(const DevicePose& pose, Float3 x) {
  return cross(pose.omega, x - pose.pivot) + pose.surface;
}

}  // namespace
}  // namespace decant::gpu
