/// \file
/// SHA-256 of texts and files, and of what a fixture must find unchanged.
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace decant {

/// Hexadecimal SHA-256 over all fields rounded to fp32, integers as int64, in the order of
/// formats/fixture.md. Equal digests mean equal fields; unequal ones may also come from another
/// compiler's last bits, then the sample decides.
std::string digest_of(const Fields& fields);

/// Hexadecimal SHA-256 over every container's wall count (uint64) and positions (fp32, x y z).
std::string digest_of(const Walls& walls);

/// Hexadecimal SHA-256 of a text.
std::string sha256_of_text(std::string_view text);
/// Hexadecimal SHA-256 of a file's bytes. Throws InputError where it cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

}  // namespace decant
