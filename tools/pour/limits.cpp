/// \file
/// Looks for the first row beyond each limit.
#include "tools/pour/limits.hpp"

#include "reference/larger.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace decant::pour {

std::vector<LimitExceeded> limits_exceeded(const std::vector<TimelineRow>& rows, const SceneLimits& limits) {
  const auto beyond = [&](const char* name, const char* unit, double bound, auto value, auto particle) {
    LimitExceeded e;
    e.limit = name;
    e.unit = unit;
    e.bound = bound;
    for (const TimelineRow& row : rows) {
      if (row.*value <= bound) continue;
      ++e.frames;
      e.largest = e.frames == 1 ? row.*value : larger(e.largest, row.*value);
      if (e.frames > 1) continue;
      e.frame = row.frame;
      e.particle = row.*particle;
      e.value = row.*value;
    }
    return e;
  };
  std::vector<LimitExceeded> all = {
      beyond("time_step_speed", "m/s", limits.time_step_speed, &TimelineRow::max_speed, &TimelineRow::fastest_particle),
      beyond("sound_speed_quarter", "m/s", limits.sound_speed_quarter, &TimelineRow::max_speed,
             &TimelineRow::fastest_particle),
      beyond("density", "kg/m³", limits.density, &TimelineRow::max_density, &TimelineRow::densest_particle)};
  std::erase_if(all, [](const LimitExceeded& e) { return e.frames == 0; });
  return all;
}

std::string describe(const LimitExceeded& e) {
  const std::string what = fmt::format("frame {}: particle {} at {:.4g} {}, ", e.frame, e.particle, e.value, e.unit);
  if (e.limit == "time_step_speed")
    return what + fmt::format("faster than the {:.4g} m/s that the time step was derived for", e.bound);
  if (e.limit == "sound_speed_quarter") return what + fmt::format("faster than c0/4 = {:.4g} m/s", e.bound);
  return what + fmt::format("denser than the {:.4g} kg/m³ that the speed of sound allows for", e.bound);
}

}  // namespace decant::pour
