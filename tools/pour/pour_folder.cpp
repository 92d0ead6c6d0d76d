/// \file
/// Looks at a folder and its disk before any work.
#include "tools/pour/pour_folder.hpp"

#include "reference/error.hpp"
#include "tools/frames/csv_writer.hpp"

#include <fmt/format.h>

#include <sys/stat.h>
#include <algorithm>
#include <string>

namespace decant::pour {
namespace fs = std::filesystem;
namespace {

std::int64_t bytes_on_disk(const fs::path& file) {
  struct stat found{};
  return ::stat(file.c_str(), &found) == 0 ? std::int64_t{512} * found.st_blocks : 0;
}

std::string size_text(double bytes) {
  if (bytes >= 1e9) return fmt::format("{:.1f} GB", 1e-9 * bytes);
  return bytes >= 1e6 ? fmt::format("{:.1f} MB", 1e-6 * bytes) : fmt::format("{:.1f} kB", 1e-3 * bytes);
}

}  // namespace

void check_folder(const Options& options, const Files& files) {
  const auto refuse = [&](const char* option, const char* why) {
    throw InputError("command line", option, options.out.string(), why);
  };
  if (fs::exists(options.out) && !fs::is_directory(options.out)) refuse("--out", "must be a folder");
  const bool unfinished = fs::exists(files.checkpoint);
  const bool complete = fs::exists(files.frames) && !unfinished;
  if (options.resume && complete) refuse("--resume", "holds a complete pour, nothing is left to do");
  if (options.resume && !unfinished) refuse("--resume", "holds no checkpoint.h5 to resume from");
  if (!options.resume && unfinished) refuse("--out", "holds an unfinished pour; add --resume, or name another folder");
  if (!options.resume && complete) refuse("--out", "holds a pour already; name another folder");
}

void check_room(const Options& options, const Files& files, const frames::Layout& layout, std::int64_t frames_done) {
  const double share = 1.0 - static_cast<double>(frames_done) / static_cast<double>(layout.frames);
  // Checkpoints: state in double, twice while one replaces the other. A vertex a particle. Per frame: XDMF, VTKHDF
  // and timeline.
  const std::int64_t beside = (2 * 48 + 16) * layout.particles + 4000 * layout.frames;
  const double needed =
      static_cast<double>(std::max<std::int64_t>(frames::file_bytes(layout) - bytes_on_disk(files.partial), 0) +
                          beside) +
      (options.csv ? share * static_cast<double>(frames::csv_bytes(layout)) : 0.0);
  fs::path there = fs::absolute(options.out);
  while (!fs::exists(there) && there.has_relative_path()) there = there.parent_path();
  const auto available = static_cast<double>(fs::space(there).available);
  const std::int64_t all_frames = frames::file_bytes(layout) + (options.csv ? frames::csv_bytes(layout) : 0);
  if (!options.quiet)
    fmt::print(stderr, "disk: {} frames of {}, needs {}, {} free\n", layout.frames - frames_done,
               size_text(static_cast<double>(all_frames) / static_cast<double>(layout.frames)), size_text(needed),
               size_text(available));
  if (!(needed <= available))
    throw InputError("command line", "--out", options.out.string(),
                     fmt::format("needs {}, free are {}", size_text(needed), size_text(available)));
}

}  // namespace decant::pour
