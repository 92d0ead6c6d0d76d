/// \file
/// What Pipeline and the searches hand each other, apart from the arrays.
#pragma once

#include "gpu/options.hpp"
#include "gpu/passes.cuh"
#include "gpu/queue.cuh"

#include <type_traits>
#include <vector>

namespace decant::gpu::DECANT_EXECUTOR {

/// Wall particles on the device, container by container in the order of their ids; a search may bring
/// a container's into another order before anything else, and finds their volumes.
struct WallStore {
  std::vector<WallSegment> segments;  // tables and bounds are the search's to fill
  std::vector<bool> moves;
  Walls walls;

  int padded_total() const { return segments.empty() ? 0 : padded(segments.back().end); }
  /// Slots [first, first + moving_count) hold all that moves.
  int first_moving = 0, moving_end = 0;
  int moving_count() const { return moving_end - first_moving; }
  template <PlacedFor what = PlacedFor::both>
  PlaceWallsPass<what> moving(const Arrays& a) const {
    return {a, walls, first_moving};
  }
};

/// Stage times, where they are wanted.
class Laps {
 public:
  Laps() = default;
  Laps(Queue& queue, Stopwatch& watch, StageTimes& times)
      : queue_(&queue), watch_(&watch), times_(&times) {
    watch.start(queue);
  }
  void build() const { lap(&StageTimes::build); }
  void density() const { lap(&StageTimes::density); }
  void force() const { lap(&StageTimes::force); }
  void integrate() const { lap(&StageTimes::integrate); }

 private:
  void lap(StageTimes::Stage StageTimes::*stage) const {
    if (watch_) watch_->lap(*queue_, times_->*stage);
  }
  Queue* queue_ = nullptr;
  Stopwatch* watch_ = nullptr;
  StageTimes* times_ = nullptr;
};

/// Calls with std::true_type where an axis is periodic, else std::false_type: known to kernels when
/// they are compiled, so that free scenes pay nothing.
template <class Call>
void with_periodic(const Constants& c, Call call) {
  if (c.any_periodic)
    call(std::true_type());
  else
    call(std::false_type());
}

/// Calls with the number of lanes as a constant; the host has one.
template <class Call>
void with_lanes([[maybe_unused]] int lanes, Call call) {
#ifdef __CUDACC__
  if (lanes == 8) return call(std::integral_constant<int, 8>());
  if (lanes == 4) return call(std::integral_constant<int, 4>());
  if (lanes == 2) return call(std::integral_constant<int, 2>());
#endif
  call(std::integral_constant<int, 1>());
}

}  // namespace decant::gpu::DECANT_EXECUTOR
