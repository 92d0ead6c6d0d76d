/// \file
/// Schedules of tilt and translation: keys, what goes on after them, an oscillation.
#include "reference/scene_motion_reader.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace decant {
namespace {

/// A direction as a unit vector.
Vec3 read_axis(const JsonValue& v) {
  const Vec3 axis = v.vector(coordinate);
  const double length = axis.norm();
  if (!(length > 1e-6)) v.refuse("a direction longer than 1e-6; it need not be a unit");
  // An axis that is a unit to rounding stays in its bits, so that a written scene reads back equal.
  return std::abs(length - 1.0) > 1e-14 ? Vec3(axis / length) : axis;
}

/// The time of a key, later than `before` where that has one.
template <class Key>
double read_key_time(const JsonValue& key, const std::vector<Key>& before) {
  const double time = key["time"].number(non_negative);
  if (!before.empty() && !(time > before.back().time))
    key["time"].refuse("later than the key before it, at " + to_text(before.back().time));
  return time;
}

/// \param read  (amplitude's value) → amplitude
template <class Value, class Read>
Oscillation<Value> read_oscillation(const JsonValue& v, const std::string& keys, Read read) {
  v.check_keys(keys_of(keys));
  return {read(v["amplitude"]), v["frequency"].number(positive),
          v.has("phase") ? v["phase"].number({.low = -1e3, .high = 1e3}) : 0.0};
}

}  // namespace

const ObjectKeys& keys_of(const std::string& name) {
  const auto& all = scene_file_keys();
  return *std::find_if(all.begin(), all.end(), [&](const ObjectKeys& k) { return k.name == name; });
}

Tilt read_tilt(const JsonValue& v) {
  v.check_keys(keys_of("tilt"));
  // A double has an angle of 1e6 rad within 1e-10.
  const Range turns{.low = -1e6, .high = 1e6};
  Tilt tilt{v["pivot"].vector(coordinate), read_axis(v["axis"]), {}};
  if (v.has("keys") + v.has("rate") + v.has("oscillation") == 0) v.refuse("at least one of keys, rate, oscillation");
  if (v.has("keys"))
    for (const auto& key : v["keys"].elements(1, 10000)) {
      key.check_keys(keys_of("tilt_key"));
      if (key.has("angle") == key.has("angle_deg")) key.refuse("exactly one of angle (rad) and angle_deg");
      const double time = read_key_time(key, tilt.keys);
      constexpr double degree = std::numbers::pi / 180.0;
      const double angle = key.has("angle") ? key["angle"].number(turns) : key["angle_deg"].number(turns) * degree;
      tilt.keys.push_back({time, angle});
    }
  else tilt.keys = {{0.0, 0.0}};
  if (v.has("rate")) tilt.rate = v["rate"].number(turns);
  if (v.has("oscillation"))
    tilt.oscillation = read_oscillation<double>(v["oscillation"], "tilt_oscillation",
                                                [&](const JsonValue& amplitude) { return amplitude.number(turns); });
  return tilt;
}

Translation read_translation(const JsonValue& v) {
  v.check_keys(keys_of("translation"));
  if (v.has("keys") + v.has("velocity") + v.has("oscillation") == 0)
    v.refuse("at least one of keys, velocity, oscillation");
  Translation translation;
  if (v.has("keys")) {
    translation.keys.clear();
    for (const auto& key : v["keys"].elements(1, 10000)) {
      key.check_keys(keys_of("translation_key"));
      const double time = read_key_time(key, translation.keys);
      translation.keys.push_back({time, key["offset"].vector(coordinate)});
    }
  }
  if (v.has("velocity")) translation.velocity = v["velocity"].vector(speed);
  if (v.has("oscillation"))
    translation.oscillation =
        read_oscillation<Vec3>(v["oscillation"], "translation_oscillation",
                               [](const JsonValue& amplitude) { return amplitude.vector(coordinate); });
  return translation;
}

}  // namespace decant
