/// \file
/// Work that goes on while the solver does: a thread that is handed one piece after another.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace decant {

/// Does what it is handed in that order. After a failure it does nothing more.
class WorkThread {
 public:
  /// \param capacity  pieces that may wait or be under way
  explicit WorkThread(std::size_t capacity = 1);
  /// Drops what waits and ends the thread.
  ~WorkThread();
  WorkThread(const WorkThread&) = delete;
  WorkThread& operator=(const WorkThread&) = delete;

  /// Hands over a piece of work; waits for room. Throws what earlier work threw.
  void push(std::function<void()> work);
  /// Waits until all is done. Throws what work threw.
  void drain();

 private:
  void run();

  const std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  bool busy_ = false, stop_ = false;
  std::exception_ptr failure_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace decant
