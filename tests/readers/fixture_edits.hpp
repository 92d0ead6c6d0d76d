/// \file
/// One object of an HDF5 file made another: taken away, of another type or shape, with a value that
/// should not be there, a link that leads in a circle.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace decant::readers {

/// A file of this process that goes with the object.
class ScratchFile {
 public:
  explicit ScratchFile(std::string_view bytes);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::string bytes() const;

 private:
  std::filesystem::path path_;
};

/// The file after one edit, chosen by the seed; empty where HDF5 did not write the bytes itself or
/// cannot edit them. HDF5 1.10 is not safe against damage within its own structures: only what ends in
/// a seal, a hash of all before it, is given to it to write in. It does not read past its own end.
std::string edited_fixture(std::string_view bytes, unsigned seed);

}  // namespace decant::readers
