/// \file
/// One pour from its first frame to its last: solver, audit, frames, timeline, checkpoints. Knows
/// no command line, so that tests can pour with any backend.
///
/// What lies in the output folder: frames.h5, frames and walls as .xdmf and .vtkhdf, timeline.h5,
/// csv/ when all is done; frames.h5.partial and checkpoint.h5 as long as it is not.
#pragma once

#include "oracle/backend.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"
#include "tools/pour/limits.hpp"
#include "tools/pour/timeline.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

namespace decant::pour {

struct Result;

/// Where a pour goes, and how it is stopped.
struct Options {
  std::filesystem::path out;
  bool csv = false, resume = false, quiet = false;
  double checkpoint_seconds = 30;  // s, wall time between checkpoints; 0: as often as can be
  /// Asked after every segment of a frame; true: leave a checkpoint and return. Where `leave` is given, asked
  /// by another thread too.
  std::function<bool()> stop;
  /// Ends the process where a call of the backend's is still under way half a second after a stop: called
  /// by another thread when the checkpoint is written, with what there is to say. `frame` is −1 where there
  /// is no checkpoint yet.
  std::function<void(const Result&)> leave;
  std::uint32_t perturbation = 0;  // not 0: from perturbed_start with this seed
};

/// How far a pour came, and what it gave.
struct Result {
  bool finished = false;      // false: stopped, a checkpoint lies in the folder
  std::int64_t frame = 0;     // the last one written
  std::int64_t substep = 0;   // of the checkpoint, maybe within the next frame
  double fields_seconds = 0;  // s, of this session: reading states and evaluating the fields of frames
  double wait_seconds = 0;    // s, of this session: waiting until frames were looked at and written
  std::vector<LimitExceeded> limits_exceeded;
  Timeline timeline;
  Summary summary;
  RankStats ranks;  // of this session
};

/// Pours. Throws InputError where the folder holds another pour or the disk has no room;
/// BackendError where the backend reports trouble, naming particle and substep, after dumping the
/// last good state to failed-state.h5 in the folder; std::runtime_error where a file cannot be
/// written.
Result run(const Scene& scene, Backend& backend, const Options& options);

/// Every coordinate changed by a random part, up to 2⁻²². Pours that differ in nothing else show how far
/// apart their ends may be.
ParticleState perturbed_start(ParticleState state, std::uint32_t seed);

/// The scene written in `frames` frames over the same time. Substeps that the scene sets become as
/// many as keep each of them no longer than it was; derived ones are derived anew.
Scene with_frames(Scene scene, int frames);

}  // namespace decant::pour
