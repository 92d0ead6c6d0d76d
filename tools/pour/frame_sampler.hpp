/// \file
/// What is done with a state that the solver has reached: audit, timeline row, frame on the disk. A thread of its own
/// does it while the solver goes on.
#pragma once

#include "oracle/checks/audit.hpp"
#include "reference/state.hpp"
#include "tools/common/work_thread.hpp"
#include "tools/frames/frame_file.hpp"
#include "tools/pour/checkpoint.hpp"
#include "tools/pour/timeline.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

namespace decant::pour {

/// Held by the solver's loop and by whoever still looks at it.
using SharedState = std::shared_ptr<const ParticleState>;

/// What the solver's loop knows of a frame beside state and fields.
struct FrameTimes {
  std::int64_t frame = 0;
  double solver_seconds = 0;  // s, wall time of advancing since the frame before
  double wall_seconds = 0;    // s, wall time since the start
};

/// Takes one state after another, in the order in which the solver reaches them. One at a time: where a process is
/// killed, one frame at most that was handed over is not in the file.
class FrameSampler {
 public:
  /// What becomes of a frame's data. What they throw, later calls of the sampler throw.
  struct Outputs {
    std::function<void(const frames::Frame&)> write_values;  // before its places are known
    std::function<void(const frames::Frame&)> complete;
    std::function<void(const TimelineRow&)> tell;  // of a frame that is complete
  };

  FrameSampler(const Scene& scene, const frames::Layout& layout, Outputs outputs);

  /// Goes on from a checkpoint.
  void resume(const SharedState& state, std::vector<TimelineRow> rows, const std::optional<PartOfFrame>& part);

  /// A state within a frame: where walls are looked at.
  void within_frame(SharedState state);
  /// The state that ends a frame. The fields are finite.
  void end_of_frame(SharedState state, Fields fields, const FrameTimes& times);
  /// Waits until all of that is done.
  void drain() { thread_.drain(); }

  /// After `drain`: rows of the frames so far.
  const std::vector<TimelineRow>& rows() const { return rows_; }
  /// After `drain`: what is known of the frame under way.
  PartOfFrame part_of_frame() const;

  /// Fields::unwritten, made in time where that can be.
  Fields unwritten(Eigen::Index fluid, Eigen::Index wall);

 private:
  AuditResult sample(const SharedState& state);
  void write(const SharedState& state, const Fields& fields, const FrameTimes& times);

  const Scene& scene_;
  const frames::Layout& layout_;
  const Outputs outputs_;
  Audit audit_;
  SharedState last_;  // sampled
  AuditResult on_the_way_;
  std::int64_t fastest_on_the_way_ = -1;
  std::vector<TimelineRow> rows_;
  std::mutex mutex_;
  std::optional<Fields> unwritten_;  // by mutex_
  WorkThread thread_;                // last: it uses all of the above
};

}  // namespace decant::pour
