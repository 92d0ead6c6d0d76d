/// \file
/// What the device decides by itself during an advance, and what it tells the host at its end.
#pragma once

#include "gpu/core/executor.cuh"

namespace decant::gpu {
namespace {

struct DeviceStatus {
  static constexpr unsigned long long none = ~0ull;
  static constexpr int never = 0x7FFFFFFF;

  unsigned long long non_finite, escaped;   // (substep << 32) | smallest id, or none
  unsigned long long missed_pair;           // the same, of complete lists
  unsigned substeps_begun, substeps_ended;  // of this advance: whose densities, and whose end positions,
                                            // are known or being computed
  int longest_list;                         // entries that the longest list needs
  int tile_bytes;                           // memory that the largest tile needs, if one found no room; or `never`
  int rebuilds;
  int rebuild_needed;                  // neighbors must be found again
  float skin;                          // of the lists of this advance, m
  float prediction_time;               // how long before the middle of its lifetime a list is built, s
  float wall_step, wall_displacement;  // the most that any wall moves in this substep, and has moved
                                       // since the last rebuild, m
  long long stage_ns[3];               // build, density, force with integration, of persistent kernels
  // Of lists whose completeness is checked, summed over substeps.
  long long pairs, pairs_missed, wall_pairs, wall_pairs_missed;
};

/// Notes that this happened to a particle in a substep, if it is the first.
DECANT_DEVICE void report(unsigned long long* first, unsigned substep, int particle) {
  atomic_minimum(first, (static_cast<unsigned long long>(substep) << 32) | static_cast<unsigned>(particle));
}

}  // namespace
}  // namespace decant::gpu
