/// \file
/// checkpoint.h5: what an interrupted pour needs to end in the same bits as an uninterrupted one.
/// The state is kept in double; neighbor structures are rebuilt at frame starts by every backend,
/// and the audit follows paths from the last frame's positions, which are the state's own.
#pragma once

#include "oracle/backend.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"
#include "tools/timeline.hpp"

#include <filesystem>
#include <string>

namespace decant {

/// The file's schema; a reader refuses any other.
inline constexpr std::int64_t checkpoint_schema = 1;

struct Checkpoint {
  std::int64_t frame = 0;  // the state's; frames up to it are on the disk
  ParticleState state;     // full precision
  Timeline timeline;       // rows 0 … frame
  bool csv = false;
  std::string scene_json;  // canonical
  BackendInfo backend;
};

/// Written aside, then renamed. Throws std::runtime_error naming the file.
void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);

/// Throws InputError naming file and dataset.
Checkpoint read_checkpoint(const std::filesystem::path& file);

/// Refuses to continue what is not the same pour. Throws InputError naming file, the first key that
/// differs, its value now and the value then. The device may differ; the caller says so.
void check_same_pour(const std::filesystem::path& file, const Checkpoint& checkpoint,
                     const Scene& scene, const BackendInfo& backend, bool csv);

}  // namespace decant
