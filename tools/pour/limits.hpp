/// \file
/// Where a run left what its scene's time step and speed of sound were chosen for.
#pragma once

#include "reference/scene_limits.hpp"
#include "tools/pour/timeline.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace decant::pour {

/// One limit that was passed.
struct LimitExceeded {
  std::string limit;  // "time_step_speed", "sound_speed_quarter" or "density"
  std::string unit;   // of bound, value and largest
  double bound = 0;
  std::int64_t frame = -1, particle = -1;  // the first beyond
  double value = 0;                        // of that particle
  double largest = 0;                      // over the whole run
  std::int64_t frames = 0;                 // frames with a particle beyond
};

/// What passed the limits, in rows of a timeline; empty: nothing.
std::vector<LimitExceeded> limits_exceeded(const std::vector<TimelineRow>& rows, const SceneLimits& limits);

/// "frame 3: particle 17 at 10.7 m/s, faster than the 2.4 m/s that the time step was derived for".
std::string describe(const LimitExceeded& exceeded);

}  // namespace decant::pour
