/// \file
/// How far and how fast schedules of tilt and translation go at most, between any two times: what the
/// rules for scenes need to know of them.
#pragma once

#include "reference/scene.hpp"

#include <optional>
#include <vector>

namespace decant {

/// Largest |d angle/dt| in `from` … `to` (s, either may be infinite), rad/s. Exact between two keys;
/// an oscillation counts with 2π frequency · |amplitude|.
double greatest_rate(const Tilt& tilt, double from, double to);

/// Largest |d offset/dt| in `from` … `to` (s), at most the norm of its components' extremes, m/s.
double greatest_speed(const Translation& translation, double from, double to);

/// A range that holds the angle from time 0 to `end` (s), rad: that of the keys, where the tilt
/// neither goes on after them nor oscillates.
struct AngleRange {
  double low, high;
};
AngleRange angle_range(const Tilt& tilt, double end);

/// A bound of direction · offset from time 0 to `end` (s), m, with the same exactness.
double farthest_offset(const Translation& translation, const Vec3& direction, double end);

/// Times from 0 to `end` (s) that lie at the keys of the container's schedules, 0 and `end` included.
std::vector<double> key_times(const Container& container, double end);

/// The earliest time (s) from which on everything repeats with one period, plus that period: what
/// happens until then is all that happens. `end` where nothing repeats, or sooner.
double until_repetition(const std::vector<const Container*>& containers, double end);

}  // namespace decant
