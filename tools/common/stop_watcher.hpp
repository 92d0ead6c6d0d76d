/// \file
/// Stopping within a second, whatever the call that is under way.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace decant {

/// Looks over calls that cannot be interrupted, such as a backend's substeps. Where one of them is still
/// under way `patience` after a stop was asked for, `leave` is called by the watching thread and ends the
/// process; the calling thread is held at the end of its call meanwhile.
class StopWatcher {
 public:
  static constexpr double patience = 0.4;  // s

  /// \param stop   whether a stop was asked for, from any thread; \param leave  does not return
  StopWatcher(std::function<bool()> stop, std::function<void()> leave);
  ~StopWatcher();
  StopWatcher(const StopWatcher&) = delete;
  StopWatcher& operator=(const StopWatcher&) = delete;

  /// Makes a call, during which the process may be left: it writes nothing that `leave` reads.
  template <class Call>
  auto during(Call call) {
    const Span span(*this);
    return call();
  }

 private:
  struct Span {
    explicit Span(StopWatcher& owner) : watcher(owner) { watcher.set(true); }
    ~Span() { watcher.set(false); }
    StopWatcher& watcher;
  };
  void set(bool calling);
  void watch();

  std::function<bool()> stop_;
  std::function<void()> leave_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool calling_ = false, ended_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace decant
