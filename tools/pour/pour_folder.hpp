/// \file
/// The output folder of a pour: its files, whether it may be poured into, and whether there is room.
#pragma once

#include "tools/frames/frame_file.hpp"
#include "tools/pour/pour.hpp"

#include <cstdint>
#include <filesystem>

namespace decant::pour {

/// The files of one output folder.
struct Files {
  explicit Files(const std::filesystem::path& folder)
      : frames(folder / "frames.h5"),
        partial(folder / "frames.h5.partial"),
        checkpoint(folder / "checkpoint.h5"),
        timeline(folder / "timeline.h5"),
        frames_xdmf(folder / "frames.xdmf"),
        walls_xdmf(folder / "walls.xdmf"),
        frames_vtkhdf(folder / "frames.vtkhdf"),
        walls_vtkhdf(folder / "walls.vtkhdf"),
        csv(folder / "csv"),
        failed(folder / "failed-state.h5") {}

  std::filesystem::path frames, partial, checkpoint, timeline, frames_xdmf, walls_xdmf, frames_vtkhdf, walls_vtkhdf,
      csv, failed;
};

/// Refuses a folder that a new pour would overwrite, or that has nothing to resume. Throws InputError.
void check_folder(const Options& options, const Files& files);

/// Compares what the pour still needs with what the disk has, and says so. Throws InputError where the
/// disk has less. \param frames_done  frames that are written already
void check_room(const Options& options, const Files& files, const frames::Layout& layout, std::int64_t frames_done);

}  // namespace decant::pour
