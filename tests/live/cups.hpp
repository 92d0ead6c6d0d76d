/// \file
/// The scene of tests of `decant live`: 192 particles in a cup beside another.
#pragma once

#include "tools/live/live_scene.hpp"

#include <fstream>
#include <iterator>
#include <string>

namespace decant::test {

inline live::LiveScene cups() {
  std::ifstream in(DECANT_SOURCE_DIR "/tests/live/cups.json");
  return {std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()), "cups.json"};
}

}  // namespace decant::test
