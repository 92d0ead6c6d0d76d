/// \file
/// A thread that looks twenty times a second.
#include "tools/common/stop_watcher.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace decant {

StopWatcher::StopWatcher(std::function<bool()> stop, std::function<void()> leave)
    : stop_(std::move(stop)), leave_(std::move(leave)), thread_([this] { watch(); }) {}

StopWatcher::~StopWatcher() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void StopWatcher::set(bool calling) {
  const std::lock_guard lock(mutex_);
  calling_ = calling;
}

void StopWatcher::watch() {
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> longest(patience);
  Clock::time_point asked = Clock::time_point::max();
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, std::chrono::milliseconds(50), [this] { return ended_; })) {
    if (!stop_()) continue;
    asked = std::min(asked, Clock::now());
    // The lock is kept: the call cannot end any more.
    if (calling_ && Clock::now() - asked >= longest) leave_();
  }
}

}  // namespace decant
