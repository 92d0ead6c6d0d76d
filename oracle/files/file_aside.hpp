/// \file
/// How every file is written: aside, under a hidden name of its own, and renamed. Two programs that
/// write to one place at once never mix: the file that stands there is whole, and of the later one.
#pragma once

#include <filesystem>
#include <string_view>

namespace decant {

/// A file on its way. Without `commit` nothing of it is left behind.
class FileAside {
 public:
  /// Opens a new file beside `file`. Throws std::runtime_error naming `file` where it is a folder or its
  /// place cannot be written.
  explicit FileAside(std::filesystem::path file);
  ~FileAside();
  FileAside(const FileAside&) = delete;
  FileAside& operator=(const FileAside&) = delete;

  /// Appends bytes. Throws std::runtime_error naming the file.
  void write(std::string_view bytes);
  /// Hands the file to the disk and gives it its name; the last call. Throws std::runtime_error naming the
  /// file.
  void commit();

  const std::filesystem::path& file() const { return file_; }
  /// Where it lies until then.
  const std::filesystem::path& aside() const { return aside_; }

 private:
  [[noreturn]] void fail(const char* why) const;

  std::filesystem::path file_, aside_;
  int descriptor_ = -1;
};

/// Writes a text, whole or not at all. Throws std::runtime_error naming the file.
void write_text_file(const std::filesystem::path& file, std::string_view text);

}  // namespace decant
