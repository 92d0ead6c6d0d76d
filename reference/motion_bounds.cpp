/// \file
/// Piece by piece: cubics between keys, straight lines after them, sinusoids over everything.
#include "reference/motion_bounds.hpp"

#include "reference/pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace decant {
namespace {

/// One component of a schedule between two keys.
struct Cubic {
  double from, to;      // s
  double before, turn;  // the value at `from`, and what is added to it
  double slope;         // at `to`; 0 at `from`

  double rate(double s) const { return turn * 6.0 * s * (1.0 - s) / (to - from) + slope * (s * (3.0 * s - 2.0)); }
  /// Largest |rate| between two times.
  double greatest_rate(double t0, double t1) const {
    const double s0 = std::clamp((t0 - from) / (to - from), 0.0, 1.0);
    const double s1 = std::clamp((t1 - from) / (to - from), 0.0, 1.0);
    double greatest = std::max(std::abs(rate(s0)), std::abs(rate(s1)));
    // rate' = 0 at (6 D − 2 r)/(12 D − 6 r), D the mean rate and r the slope at the end.
    const double mean = turn / (to - from), under = 12 * mean - 6 * slope;
    const double top = slope == 0 ? 0.5 : (6 * mean - 2 * slope) / under;
    if (top > s0 && top < s1) greatest = std::max(greatest, std::abs(rate(top)));
    return greatest;
  }
};

/// \param of  (key) → one component of its value; \param slope  after the last key
template <class Key, class Of>
double greatest_rate(const std::vector<Key>& keys, Of of, double slope, double from, double to) {
  double greatest = to > keys.back().time ? std::abs(slope) : 0.0;
  auto next = std::upper_bound(keys.begin(), keys.end(), from, [](double t, const Key& key) { return t < key.time; });
  if (next == keys.begin()) ++next;
  for (; next != keys.end() && (next - 1)->time <= to; ++next) {
    const Cubic cubic{(next - 1)->time, next->time, of(*(next - 1)), of(*next) - of(*(next - 1)),
                      next + 1 == keys.end() ? slope : 0.0};
    greatest = std::max(greatest, cubic.greatest_rate(from, to));
  }
  return greatest;
}

/// The values that a schedule has from time 0 to `end` (s), without its oscillation: extreme at a key,
/// at either end, or, where the last cubic ends with a slope, within the hull of its control points.
/// \param of  (key) → the value; \param at  (time) → the value; \param slope  after the last key
template <class Key, class Of, class At>
AngleRange range(const std::vector<Key>& keys, Of of, At at, double slope, double end) {
  AngleRange all{infinity, -infinity};
  const auto see = [&](double value) {
    all.low = std::min(all.low, value);
    all.high = std::max(all.high, value);
  };
  see(at(0.0));
  see(at(end));
  for (const auto& key : keys)
    if (key.time > 0 && key.time < end) see(of(key));
  const std::size_t n = keys.size();
  if (slope == 0 || n < 2 || !(keys[n - 2].time < end)) return all;
  see(of(keys[n - 2]));
  see(of(keys[n - 1]) - slope * (keys[n - 1].time - keys[n - 2].time) / 3);
  see(of(keys[n - 1]));
  return all;
}

double angle_of(const TiltKey& key) { return key.angle; }

void add_period(double period, std::vector<double>& to) {
  for (const double known : to)
    if (std::abs(period - known) <= 1e-12 * known) return;
  to.push_back(period);
}

}  // namespace

double greatest_rate(const Tilt& tilt, double from, double to) {
  double rate = greatest_rate(tilt.keys, angle_of, tilt.rate, from, to);
  if (tilt.oscillation)
    rate += 2 * std::numbers::pi * tilt.oscillation->frequency * std::abs(tilt.oscillation->amplitude);
  return rate;
}

double greatest_speed(const Translation& translation, double from, double to) {
  Vec3 speed;
  for (Eigen::Index a = 0; a < 3; ++a)
    speed[a] = greatest_rate(
        translation.keys, [a](const TranslationKey& key) { return key.offset[a]; }, translation.velocity[a], from, to);
  double greatest = speed.norm();
  if (translation.oscillation)
    greatest += 2 * std::numbers::pi * translation.oscillation->frequency * translation.oscillation->amplitude.norm();
  return greatest;
}

AngleRange angle_range(const Tilt& tilt, double end) {
  Tilt plain = tilt;
  plain.oscillation.reset();
  const AngleRange all = range(tilt.keys, angle_of, [&](double t) { return tilt_at(plain, t).angle; }, tilt.rate, end);
  const double swing = tilt.oscillation ? std::abs(tilt.oscillation->amplitude) : 0.0;
  return {all.low - swing, all.high + swing};
}

double farthest_offset(const Translation& translation, const Vec3& direction, double end) {
  Translation plain = translation;
  plain.oscillation.reset();
  double farthest = range(
                        translation.keys, [&](const TranslationKey& key) { return direction.dot(key.offset); },
                        [&](double t) { return direction.dot(translation_at(plain, t).offset); },
                        direction.dot(translation.velocity), end)
                        .high;
  if (translation.oscillation) farthest += std::abs(direction.dot(translation.oscillation->amplitude));
  return farthest;
}

std::vector<double> key_times(const Container& container, double end) {
  std::vector<double> times = {0.0, end};
  const auto see = [&](double time) {
    if (time > 0 && time < end) times.push_back(time);
  };
  if (container.tilt)
    for (const auto& key : container.tilt->keys) see(key.time);
  if (container.translation)
    for (const auto& key : container.translation->keys) see(key.time);
  return times;
}

double until_repetition(const std::vector<const Container*>& containers, double end) {
  std::vector<double> periods;
  double settled = 0;
  for (const Container* c : containers) {
    if (c->tilt) {
      settled = std::max(settled, c->tilt->keys.back().time);
      if (c->tilt->rate != 0) add_period(2 * std::numbers::pi / std::abs(c->tilt->rate), periods);
      if (c->tilt->oscillation) add_period(1 / c->tilt->oscillation->frequency, periods);
    }
    if (c->translation) {
      settled = std::max(settled, c->translation->keys.back().time);
      if (!c->translation->velocity.isZero(0)) return end;
      if (c->translation->oscillation) add_period(1 / c->translation->oscillation->frequency, periods);
    }
  }
  if (periods.size() > 1) return end;
  return std::min(end, settled + (periods.empty() ? 0.0 : periods.front()));
}

}  // namespace decant
