/// \file
/// The device arrays of one scene, as kernels see them: fluid particles, padded to whole tiles, then the wall
/// particles of each container, padded likewise, then one sentinel far from everything.
#pragma once

#include "gpu/core/device_scene.hpp"
#include "gpu/core/device_status.cuh"

namespace decant::gpu {
namespace {

/// Particles per thread block tile; arrays that tiles are cut from are padded to a multiple of it.
inline constexpr int tile_size = 256;

DECANT_BOTH int padded(int n) { return (n + tile_size - 1) / tile_size * tile_size; }

// Positions are read several at a time, this far beyond the last.
inline constexpr std::size_t read_past_end = 24;

/// Position: x, y, z and the mass m, of wall particles ρ0 V_b (brute force: |x|²); velocity: x, y, z and the
/// wall clearance, a distance (m) that all containers' solids keep at least; 0: nothing is known.
struct Particles {
  float4 *position, *velocity;
};

/// On one rank of several: its own and nobody else's business; its own, of which others have copies; such a copy.
enum class ParticleRole : unsigned char { interior, border, ghost };

struct ParticleArrays {
  int n;                   // fluid particles
  int room;                // how many there may be
  int total;               // of all ranks
  int base;                // where wall particles begin: room for n, rounded up to whole tiles
  int sentinel;            // index of the last element
  Particles state, spare;  // the state between advances, and as much room again
  Particles current;       // where the substep begins, in the order in which kernels run
  Particles next;          // where it ends, same order
  int* id;                 // of each fluid particle, same order
  // What neighbors read in the force kernel: x, y, z, p/ρ² and v, 1/ρ; of wall particles x, y, z, 0 and
  // v, V_b.
  float4 *force_position, *force_velocity;
  float4* acceleration;  // may lie over `current.position`, which only the density kernel reads
  bool stores_square;    // positions carry |x|²
  DeviceStatus* status;
  const DevicePose* poses;  // [(substeps + 1) × containers], substep major
  int containers;
  // Where several ranks share a problem: ids are of this rank, in the order of the problem's. Null elsewhere.
  const int* global_id;      // by id, the problem's
  const ParticleRole* role;  // by id
  int* index;                // by id, where it is in the order in which kernels run
  const Box* reach;          // holds all that is within H of its own particles; null: not known
  int* farthest;             // by substep of the advance, |displacement|² of what moves farthest, float bits

  bool on_ranks() const { return global_id != nullptr; }
  DECANT_DEVICE bool is_ghost(int i) const { return role && role[id[i]] == ParticleRole::ghost; }
  /// Whether the integration of all particles leaves it alone: others move it, or it has moved before.
  DECANT_DEVICE bool moves_apart(int i) const { return role && role[id[i]] != ParticleRole::interior; }
  DECANT_DEVICE int problem_id(int own) const { return global_id ? global_id[own] : own; }

  /// At the start of the substep, for all that comes before integration, and at its end, for all that
  /// comes after the densities: the one counts what has ended, the other what has begun.
  DECANT_DEVICE const DevicePose* poses_before() const { return poses_of(status->substeps_ended); }
  DECANT_DEVICE const DevicePose* poses_after() const { return poses_of(status->substeps_begun); }

 private:
  DECANT_DEVICE const DevicePose* poses_of(unsigned substep) const {
    return poses + static_cast<std::size_t>(substep) * static_cast<std::size_t>(containers);
  }
};

/// Results of an evaluation, by id; vectors are [n,3]. All null in an advance.
struct OutputArrays {
  float *density, *pressure;
  float *pressure_acceleration, *viscous_acceleration, *wall_pressure_acceleration, *wall_viscous_acceleration,
      *acceleration;
  int *fluid_count, *wall_count;
  long long *fluid_id_sum, *wall_id_sum;
};

/// v as row `id` of a [n,3] array.
DECANT_DEVICE void store(float* to, int id, Float3 v) {
  const auto k = 3 * static_cast<std::size_t>(id);
  to[k] = v.x;
  to[k + 1] = v.y;
  to[k + 2] = v.z;
}

}  // namespace
}  // namespace decant::gpu
