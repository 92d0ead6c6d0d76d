/// \file
/// Scene files: JSON with comments, parsed strictly. Unknown keys, wrong types and values out of
/// range are refused with file, key, value and bound; nothing is clamped.
#pragma once

#include "reference/scene.hpp"
#include "reference/scene_checks.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace decant {

/// Parses and range-checks one scene. Throws InputError.
/// \param text  JSON, // and /* */ comments allowed; \param file  the name for messages
Scene parse_scene(std::string_view text, const std::string& file);

/// The text of a scene file. Throws InputError where it cannot be read.
std::string read_scene_text(const std::filesystem::path& file);

/// Reads, parses and checks (scene_checks.hpp) a scene file; derives the substeps of a frame
/// unless the file sets them. Throws InputError; warnings go to `warnings` where one is given.
Scene load_scene(const std::filesystem::path& file, std::vector<std::string>* warnings = nullptr);
/// The same of a file's text. \param distances  of its containers, where they are those of a scene that was checked
Scene complete_scene(const std::string& text, const std::string& file, std::vector<std::string>* warnings = nullptr,
                     Distances distances = Distances::unknown);

/// Canonical JSON of a scene, everything explicit; parse_scene(scene_to_json(s)) equals s bitwise.
std::string scene_to_json(const Scene& scene);

}  // namespace decant
