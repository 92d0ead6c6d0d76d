/// \file
/// Looks for recordings beside the binary, so that the command works from any folder.
#include "tools/commands/fixture_folder.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "reference/error.hpp"
#include "tools/commands/help_text.hpp"

#include <algorithm>
#include <cstdlib>

namespace decant {
namespace {

namespace fs = std::filesystem;

/// Study-scale recordings hold a sample of the oracle's answer. What cannot be read counts as small, so
/// that somebody is told.
bool is_small(const fs::path& file) {
  try {
    return !Hdf5Reader(file).has("/sample");
  } catch (const InputError&) {
    return true;
  }
}

std::vector<fs::path> recordings(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".h5" && !entry.path().filename().string().starts_with("."))
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

fs::path fixture_folder() {
  if (const char* named = std::getenv("DECANT_FIXTURES"); named && *named) {
    if (!fs::is_directory(named)) throw InputError("environment", "DECANT_FIXTURES", named, "must name a folder");
    return named;
  }
  std::error_code error;
  const fs::path binary = fs::read_symlink("/proc/self/exe", error);
  const fs::path start = error ? fs::current_path() : binary.parent_path();
  const fs::path installed = start.parent_path() / "share" / "decant" / "fixtures";
  if (!recordings(installed).empty()) return installed;
  for (fs::path folder = start;; folder = folder.parent_path()) {
    if (!recordings(folder / "fixtures").empty()) return folder / "fixtures";
    if (folder == folder.parent_path()) break;
  }
  throw InputError("command line", "FIXTURE", "none",
                   "name recordings, or set DECANT_FIXTURES: no folder `fixtures` with *.h5 above " + start.string());
}

std::vector<fs::path> fixtures_in(const fs::path& folder, bool all) {
  std::vector<fs::path> files = recordings(folder);
  if (!all) std::erase_if(files, [](const fs::path& file) { return !is_small(file); });
  if (files.empty())
    throw InputError(folder.string(), "recordings", "none", all ? "at least one *.h5" : "at least one small one");
  return files;
}

fs::path recording_called(const std::string& given) {
  if (given.empty() || given.find('/') != std::string::npos || fs::exists(given)) return given;
  try {
    const fs::path folder = fixture_folder();
    for (const fs::path& file : {folder / given, folder / (given + ".h5")})
      if (fs::is_regular_file(file)) return file;
    std::vector<std::string> names;
    for (const fs::path& file : recordings(folder)) names.push_back(file.stem().string());
    const std::string meant = nearest_name(given, names);
    if (!meant.empty())
      throw InputError("command line", "FIXTURE", given,
                       "no file, and no recording of that name; did you mean " + meant + "?");
  } catch (const InputError& error) {
    if (error.key() == "FIXTURE" && error.value() == given) throw;
    // No such folder: reading the file says so.
  }
  return given;
}

}  // namespace decant
