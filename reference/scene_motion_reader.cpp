/// \file
/// Schedules of tilt and translation: keys, what goes on after them, an oscillation.
#include "reference/scene_motion_reader.hpp"

#include <cmath>
#include <numbers>
#include <vector>

namespace decant {
namespace {

/// A direction as a unit vector.
Vec3 read_axis(const JsonValue& v) {
  const Vec3 axis = v.vector();
  const double length = axis.norm();
  if (!(length > 1e-6)) v.refuse("a direction longer than 1e-6; it need not be a unit");
  // An axis that is a unit to rounding stays in its bits, so that a written scene reads back equal.
  return std::abs(length - 1.0) > 1e-14 ? Vec3(axis / length) : axis;
}

/// The time of a key, later than `before` where that has one.
template <class Key>
double read_key_time(const JsonValue& key, const std::vector<Key>& before) {
  const double time = key["time"].number();
  if (!before.empty() && !(time > before.back().time))
    key["time"].refuse("later than the key before it, at " + to_text(before.back().time));
  return time;
}

/// \param read  (amplitude's value) → amplitude
template <class Value, class Read>
Oscillation<Value> read_oscillation(const JsonValue& v, Read read) {
  v.check_keys();
  Oscillation<Value> oscillation{read(v["amplitude"]), v["frequency"].number()};
  if (v.has("phase")) oscillation.phase = v["phase"].number();
  return oscillation;
}

}  // namespace

Tilt read_tilt(const JsonValue& v) {
  v.check_keys();
  Tilt tilt{v["pivot"].vector(), read_axis(v["axis"]), {}};
  v.check_alternatives();
  if (v.has("keys"))
    for (const auto& key : v["keys"].elements()) {
      key.check_keys();
      key.check_alternatives();
      const double time = read_key_time(key, tilt.keys);
      constexpr double degree = std::numbers::pi / 180.0;
      const double angle = key.has("angle") ? key["angle"].number() : key["angle_deg"].number() * degree;
      tilt.keys.push_back({time, angle});
    }
  else tilt.keys = {{0.0, 0.0}};
  if (v.has("rate")) tilt.rate = v["rate"].number();
  if (v.has("oscillation"))
    tilt.oscillation =
        read_oscillation<double>(v["oscillation"], [](const JsonValue& amplitude) { return amplitude.number(); });
  return tilt;
}

Translation read_translation(const JsonValue& v) {
  v.check_keys();
  v.check_alternatives();
  Translation translation;
  if (v.has("keys")) {
    translation.keys.clear();
    for (const auto& key : v["keys"].elements()) {
      key.check_keys();
      const double time = read_key_time(key, translation.keys);
      translation.keys.push_back({time, key["offset"].vector()});
    }
  }
  if (v.has("velocity")) translation.velocity = v["velocity"].vector();
  if (v.has("oscillation"))
    translation.oscillation =
        read_oscillation<Vec3>(v["oscillation"], [](const JsonValue& amplitude) { return amplitude.vector(); });
  return translation;
}

}  // namespace decant
