/// \file
/// Puts frames on the disk from a thread of its own, so that the solver does not wait for the disk.
#pragma once

#include "oracle/checks/audit.hpp"
#include "reference/state.hpp"
#include "tools/frames/csv_writer.hpp"
#include "tools/frames/frame_file.hpp"

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace decant {

/// A frame of one state: rounded to fp32, moving walls posed at its time. `fields` gives density
/// and pressure, `audit` the places.
Frame make_frame(const Scene& scene, const FrameLayout& layout, std::int64_t index, const ParticleState& state,
                 const Fields& fields, const AuditResult& audit);

/// Queue with a bounded number of frames and the thread that empties it.
class FrameWriter {
 public:
  /// \param write  called with one frame at a time, on the writer's thread; \param capacity  frames
  /// that may wait
  explicit FrameWriter(std::function<void(const Frame&)> write, std::size_t capacity = 3);
  /// Drops what waits and ends the thread.
  ~FrameWriter();
  FrameWriter(const FrameWriter&) = delete;
  FrameWriter& operator=(const FrameWriter&) = delete;

  /// Hands over a frame; waits while the queue is full. Throws what `write` threw.
  void push(Frame frame);
  /// Waits until every frame handed over is written. Throws what `write` threw.
  void drain();

 private:
  void run();

  std::function<void(const Frame&)> write_;
  const std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> waiting_;
  bool busy_ = false, stop_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace decant
