/// \file
/// One writer in a folder at a time.
#pragma once

#include <filesystem>

namespace decant::pour {

/// Keeps other processes out of a folder as long as this lives; a process that ends, however it ends, lets
/// go. Nothing is left in the folder. Where the file system has no such locks (some network ones) it keeps
/// nobody out.
class FolderLock {
 public:
  /// Throws InputError naming `option` and the folder where another process has it, std::runtime_error
  /// where the folder cannot be opened.
  FolderLock(const char* option, const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace decant::pour
