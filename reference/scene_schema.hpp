/// \file
/// The JSON Schema of scene files, for editors: generated from the table that the reader refuses by.
#pragma once

#include <string>

namespace decant {

/// The text of fixtures/scenes/scene.schema.json: JSON Schema, draft 2020-12, of scene_format().
std::string scene_schema();

}  // namespace decant
