/// \file
/// The scenes that tests start from.
#pragma once

#include <filesystem>

namespace decant::test {

inline const std::filesystem::path scenes = std::filesystem::path(DECANT_SOURCE_DIR) / "fixtures/scenes";

}  // namespace decant::test
