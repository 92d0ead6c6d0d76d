/// \file
/// The writer's queue, and how a state becomes a frame.
#include "tools/frames/frame_writer.hpp"

#include <utility>

namespace decant {

Frame make_frame(const Scene& scene, const FrameLayout& layout, std::int64_t index, const ParticleState& state,
                 const Fields& fields, const AuditResult& audit) {
  const auto n = static_cast<std::size_t>(state.size());
  Frame frame;
  frame.index = index;
  frame.time = scene.time_at(state.substep);
  frame.position.resize(3 * n);
  frame.velocity.resize(3 * n);
  frame.density.resize(n);
  frame.pressure.resize(n);
  Eigen::Map<Eigen::Matrix3Xf>(frame.position.data(), 3, state.size()) = state.position.cast<float>();
  Eigen::Map<Eigen::Matrix3Xf>(frame.velocity.data(), 3, state.size()) = state.velocity.cast<float>();
  Eigen::Map<Eigen::VectorXf>(frame.density.data(), state.size()) = fields.density.cast<float>();
  Eigen::Map<Eigen::VectorXf>(frame.pressure.data(), state.size()) = fields.pressure.cast<float>();
  frame.place = audit.region;
  for (std::size_t c = 0; c < layout.walls.size(); ++c)
    if (layout.walls[c].moving)
      frame.wall.push_back(posed_vertices(scene.containers.at(c), layout.walls[c].surface, frame.time));
  return frame;
}

FrameWriter::FrameWriter(std::function<void(const Frame&)> write, std::size_t capacity)
    : write_(std::move(write)), capacity_(capacity), thread_([this] { run(); }) {}

FrameWriter::~FrameWriter() {
  {
    std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FrameWriter::push(Frame frame) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.size() < capacity_ || failure_; });
  if (failure_) std::rethrow_exception(failure_);
  waiting_.push_back(std::move(frame));
  changed_.notify_all();
}

void FrameWriter::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (waiting_.empty() && !busy_) || failure_; });
  if (failure_) std::rethrow_exception(failure_);
}

void FrameWriter::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    const Frame frame = std::move(waiting_.front());
    waiting_.pop_front();
    busy_ = true;
    changed_.notify_all();
    lock.unlock();
    std::exception_ptr failure;
    try {
      write_(frame);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    busy_ = false;
    failure_ = failure;
    changed_.notify_all();
    // A frame is missing from here on; writing later ones would hide it.
    if (failure_) return;
  }
}

}  // namespace decant
