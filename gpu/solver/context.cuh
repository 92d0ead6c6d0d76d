/// \file
/// What the solver and a neighbor search hand each other, apart from the arrays.
#pragma once

#include "gpu/core/stage_timer.cuh"
#include "gpu/kernels/place_walls.cuh"
#include "gpu/options.hpp"

#include <cstdint>
#include <type_traits>
#include <vector>

namespace decant::gpu {
namespace {

/// Wall particles on the device, container by container in the order of their ids; a search may bring a
/// container's into another order when it loads them, and finds their volumes.
struct WallStore {
  std::vector<WallSegment> segments;  // tables and bounds are the search's to fill
  std::vector<bool> moves;
  Walls walls;
  std::uint64_t version = 0;             // another number wherever what is on the device is other than before
  int first_moving = 0, moving_end = 0;  // slots that hold all that moves

  int padded_total() const { return segments.empty() ? 0 : padded(segments.back().end); }
  int moving_count() const { return moving_end - first_moving; }
  template <WallsFor what = WallsFor::both>
  PlaceWalls<what> moving(const ParticleArrays& a) const {
    return {a, walls, first_moving};
  }
};

/// Calls with std::true_type where an axis is periodic, else std::false_type: known to kernels when
/// they are compiled, so that free scenes pay nothing.
template <class Call>
void with_periodic(const Constants& c, Call call) {
  if (c.any_periodic) call(std::true_type());
  else call(std::false_type());
}

}  // namespace
}  // namespace decant::gpu
