/// \file
/// checkpoint.h5: what an interrupted pour needs to end in the same bits as an uninterrupted one.
/// The state is kept in double; what a backend carries from one segment of a frame to the next is a
/// function of it. The audit follows paths from where it last looked, which is kept where that is not the
/// state itself.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/checks/audit.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"
#include "tools/pour/timeline.hpp"

#include <filesystem>
#include <optional>
#include <string>

namespace decant::pour {

/// The file's schema; a reader refuses any other.
inline constexpr std::int64_t checkpoint_schema = 2;

/// What is known of a frame that is not over.
struct PartOfFrame {
  Eigen::Matrix3Xd looked_at;  // 3×N, m, positions when the audit last looked
  std::int64_t looked_at_substep = 0;
  AuditResult on_the_way;              // the worst of the samples since the frame before; no places
  std::int64_t fastest_particle = -1;  // of the largest speed among them
  double solver_seconds = 0;           // s, wall time of advancing since the frame before
};

/// What changes a pour beside scene and backend.
struct Choices {
  bool csv = false;
  std::uint32_t perturbation = 0;  // seed; 0: none
};

struct Checkpoint {
  std::int64_t frame = 0;           // frames up to it are on the disk
  ParticleState state;              // full precision, of this frame or within the next
  Timeline timeline;                // rows 0 … frame
  std::optional<PartOfFrame> part;  // where the state is within the next frame
  Choices choices;
  double wall_seconds = 0;  // s, since the start, all sessions together
  std::string scene_json;   // canonical
  BackendInfo backend;
};

/// Written aside, then renamed. Throws std::runtime_error naming the file.
void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);

/// Throws InputError naming file and dataset.
Checkpoint read_checkpoint(const std::filesystem::path& file);

/// Refuses to continue what is not the same pour. Throws InputError naming file, the first key that
/// differs, its value now and the value then. The device may differ; the caller says so.
void check_same_pour(const std::filesystem::path& file, const Checkpoint& checkpoint, const Scene& scene,
                     const BackendInfo& backend, const Choices& choices);

}  // namespace decant::pour
