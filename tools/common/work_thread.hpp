/// \file
/// Work that goes on while the solver does: a thread that is handed one piece after another.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace decant {

/// Does what it is handed, one piece at a time. After a failure it does nothing more.
class WorkThread {
 public:
  WorkThread();
  /// Drops a piece that waits and ends the thread.
  ~WorkThread();
  WorkThread(const WorkThread&) = delete;
  WorkThread& operator=(const WorkThread&) = delete;

  /// Hands over a piece of work, once the one before is done. Throws what earlier work threw.
  void push(std::function<void()> work);
  /// Waits until all is done. Throws what work threw.
  void drain();

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> next_;
  bool busy_ = false, stop_ = false;  // busy: handed over, and not done
  std::exception_ptr failure_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace decant
