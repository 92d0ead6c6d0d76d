/// \file
/// What a scene file may say of a container's motion, and the ranges that its numbers share.
#pragma once

#include "reference/scene.hpp"
#include "reference/scene_file.hpp"
#include "reference/scene_json_reader.hpp"

#include <string>

namespace decant {

inline constexpr Range positive{.low = 0.0, .high = 1e6, .low_open = true};
inline constexpr Range non_negative{.low = 0.0, .high = 1e6};
inline constexpr Range coordinate{.low = -1e4, .high = 1e4};  // m
inline constexpr Range speed{.low = -1e4, .high = 1e4};       // m/s

/// The keys of the object of that name in scene_file_keys().
const ObjectKeys& keys_of(const std::string& name);

/// `tilt` and `translation` of a container. Throw InputError naming file, key, value and bound.
Tilt read_tilt(const JsonValue& v);
Translation read_translation(const JsonValue& v);

}  // namespace decant
