/// \file
/// The device arrays of one scene, as passes see them.
#pragma once

#include "gpu/physics.cuh"

#include <cstdint>

namespace decant::gpu::DECANT_EXECUTOR {

/// Particles in some order. Position: x, y, z and the mass m, of wall particles ρ0 V_b (brute force: |x|²);
/// velocity: x, y, z and a distance that all containers' solids keep at least (m; 0: nothing is known).
/// Wall particles come after the fluid, from Arrays::base on.
struct Particles {
  float4 *position, *velocity;
};

/// What the device tells the host, read once an advance.
struct Mailbox {
  unsigned long long non_finite, escaped;  // (substep << 32) | smallest id; all ones: none
  unsigned begun, ended;                   // substeps of this advance whose densities, and whose end
                                           // positions, are known or being found
  int longest_list;                        // entries that the longest list needs
  int rebuilds;
  int stale;                               // neighbors must be looked for anew
  float skin;                              // of the lists of this advance, m
  float ahead;                             // how long before its lists' middle a list is made, s
  int fastest;                             // |v|² of the fastest particle, float bits
  float wall_step, wall_way;               // how far any wall moves in this substep, and since lists were
                                           // made, at most, m
  long long stage_ns[3];                   // build, density, force and integration, of a crew's substeps
  // Of lists that verify themselves, summed over substeps.
  long long pairs, pairs_missed, wall_pairs, wall_pairs_missed;
  unsigned long long missed;               // (substep << 32) | smallest id, where none may be; all ones: none
};

// Searches read points several at a time, this far beyond the last.
inline constexpr std::size_t read_past = 24;

struct Arrays {
  int n;             // fluid particles
  int base;          // where wall particles begin in the arrays below; n, rounded up to whole tiles
  int ghost;         // after all others, a point far from everything
  Particles now;     // where the substep begins, in the order in which passes run
  Particles next;    // where it ends, same order
  int* id;           // of each, same order
  float4 *point, *motion;  // x, y, z, p/rho² and v, 1/rho: what neighbors read in the force pass;
                           // of wall particles x, y, z, 0 and v, V_b
  float4* acceleration;    // may lie over `now.position`, which only the density pass reads
  bool square;  // positions carry |x|²
  Mailbox* mailbox;
  const DevicePose* poses;  // containers × (substeps + 1), substep major
  int containers;

  /// At the start of the substep, for all that comes before integration, and at its end, for all that
  /// comes after the densities: the one counts what has ended, the other what has begun.
  DECANT_DEVICE const DevicePose* poses_before() const { return poses_of(mailbox->ended); }
  DECANT_DEVICE const DevicePose* poses_after() const { return poses_of(mailbox->begun); }

 private:
  DECANT_DEVICE const DevicePose* poses_of(unsigned substep) const {
    return poses + static_cast<std::size_t>(substep) * static_cast<std::size_t>(containers);
  }
};

/// Results of `evaluate`, by id. Vectors are [n,3].
struct FieldArrays {
  float *density, *pressure;
  float *pressure_acceleration, *viscous_acceleration, *wall_pressure_acceleration,
      *wall_viscous_acceleration, *acceleration;
  int *fluid_count, *wall_count;
  long long *fluid_id_sum, *wall_id_sum;
};

DECANT_DEVICE bool is_finite(Float3 v) {
  return fabsf(v.x) <= 3.0e38f && fabsf(v.y) <= 3.0e38f && fabsf(v.z) <= 3.0e38f;
}

DECANT_DEVICE void report(unsigned long long* word, unsigned substep, int particle) {
  atomic_minimum(word, (static_cast<unsigned long long>(substep) << 32) |
                           static_cast<unsigned>(particle));
}

}  // namespace decant::gpu::DECANT_EXECUTOR
