/// \file
/// Whether a file can be written where the command line says, asked before the work.
#pragma once

#include "reference/error.hpp"

#include <filesystem>
#include <string>

namespace decant {

/// Throws InputError naming `option` where `file` lies in no folder, or is one. Empty: not asked for.
inline void check_output_place(const std::string& option, const std::string& file) {
  if (file.empty()) return;
  if (!std::filesystem::is_directory(std::filesystem::absolute(file).parent_path()) ||
      std::filesystem::is_directory(file))
    throw InputError("command line", option, file, "a file in a folder that exists");
}

}  // namespace decant
