/// \file
/// How tests compare files.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace decant::test {

/// All of a file; nothing of one that cannot be read.
inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace decant::test
