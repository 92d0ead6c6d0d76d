/// \file
/// The motion of a container, read from a scene file.
#pragma once

#include "reference/scene.hpp"
#include "reference/scene_json_reader.hpp"

namespace decant {

/// `tilt` and `translation` of a container. Throw InputError naming file, key, value and bound.
Tilt read_tilt(const JsonValue& v);
Translation read_translation(const JsonValue& v);

}  // namespace decant
