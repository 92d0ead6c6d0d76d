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

/// The same of a folder that is to hold files: it may be missing where its own folder is there.
inline void check_output_folder(const std::string& option, const std::string& folder) {
  if (folder.empty() || std::filesystem::is_directory(folder)) return;
  const auto whole = std::filesystem::absolute(std::filesystem::path(folder) / "").parent_path();
  if (!std::filesystem::is_directory(whole.parent_path()) || std::filesystem::exists(whole))
    throw InputError("command line", option, folder, "a folder, or its place in one that exists");
}

}  // namespace decant
