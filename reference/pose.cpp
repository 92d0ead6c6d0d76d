/// \file
/// The schedules of tilt and translation and the rigid motion that follows from them.
#include "reference/pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace decant {
namespace {

template <class Value>
struct Progress {
  Value value, rate;
};

/// \param value_of  of a key; \param rate  after the last key
template <class Value, class Key, class ValueOf>
Progress<Value> along_keys(const std::vector<Key>& keys, ValueOf value_of, const Value& rate, const Value& none,
                           double time) {
  const Value last = value_of(keys.back());
  if (time >= keys.back().time)
    return rate == none ? Progress<Value>{last, none} : Progress<Value>{last + rate * (time - keys.back().time), rate};
  if (time <= keys.front().time) return {value_of(keys.front()), none};
  const auto next =
      std::upper_bound(keys.begin(), keys.end(), time, [](double t, const Key& key) { return t < key.time; });
  const auto k = static_cast<std::size_t>(next - keys.begin());
  const Value before = value_of(keys[k - 1]);
  const double span = keys[k].time - keys[k - 1].time;
  const Value turn = value_of(keys[k]) - before;
  const double s = (time - keys[k - 1].time) / span;
  Progress<Value> at{before + turn * s * s * (3.0 - 2.0 * s), turn * 6.0 * s * (1.0 - s) / span};
  if (k + 1 == keys.size() && rate != none) {
    at.value += rate * (span * s * s * (s - 1.0));
    at.rate += rate * (s * (3.0 * s - 2.0));
  }
  return at;
}

template <class Value>
void add(const std::optional<Oscillation<Value>>& oscillation, double time, Progress<Value>& to) {
  if (!oscillation) return;
  const double omega = 2.0 * std::numbers::pi * oscillation->frequency;
  const double angle = omega * time + oscillation->phase;
  to.value += oscillation->amplitude * std::sin(angle);
  to.rate += oscillation->amplitude * (omega * std::cos(angle));
}

}  // namespace

TiltAngle tilt_at(const Tilt& tilt, double time) {
  auto at = along_keys<double>(tilt.keys, [](const TiltKey& k) { return k.angle; }, tilt.rate, 0.0, time);
  add(tilt.oscillation, time, at);
  return {at.value, at.rate};
}

TranslationOffset translation_at(const Translation& translation, double time) {
  auto at = along_keys<Vec3>(
      translation.keys, [](const TranslationKey& k) { return k.offset; }, translation.velocity, Vec3::Zero(), time);
  add(translation.oscillation, time, at);
  return {at.value, at.rate};
}

Pose pose_at(const Container& container, double time) {
  Pose pose;
  pose.translation = container.origin;
  pose.surface_velocity = container.surface_velocity;
  if (container.tilt) {
    const Tilt& tilt = *container.tilt;
    const TiltAngle at = tilt_at(tilt, time);
    // Sine and cosine take the turns off the angle exactly, however many there are.
    pose.rotation = Eigen::AngleAxisd(at.angle, tilt.axis).toRotationMatrix();
    pose.pivot = tilt.pivot;
    pose.translation = tilt.pivot + pose.rotation * (container.origin - tilt.pivot);
    pose.angular_velocity = at.rate * tilt.axis;
    pose.surface_velocity = pose.rotation * container.surface_velocity;
  }
  if (container.translation) {
    const TranslationOffset at = translation_at(*container.translation, time);
    pose.translation += at.offset;
    pose.pivot += at.offset;
    pose.linear_velocity = at.velocity;
  }
  return pose;
}

}  // namespace decant
