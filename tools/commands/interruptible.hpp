/// \file
/// Long work that keeps what it has done when it is told to stop.
#pragma once

#include "tools/common/stop_signal.hpp"
#include "tools/common/stop_watcher.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace decant {

/// Work in parts. After Ctrl-C or SIGTERM no part is begun, the one under way is given up, `conclude` tells
/// and writes what the parts before have given, and the process ends with 128 + the signal's number, all
/// within a second or what `conclude` takes. A second signal ends the process at once.
class Interruptible {
 public:
  /// \param conclude  maybe called by another thread, never while a part is between begin and end of what
  ///                  it hands over
  explicit Interruptible(std::function<void()> conclude);

  /// Does one part. It must not use HDF5, nor change anything that `conclude` reads; what it gives is
  /// taken over afterwards.
  template <class Part>
  void part(Part work) {
    if (StopSignal::caught() != 0) leave();
    watcher_.during([&] { work(); });
  }
  /// What the process ends with where it is interrupted.
  static int exit_status() { return 128 + StopSignal::caught(); }

 private:
  [[noreturn]] void leave();

  StopSignal signal_;
  std::function<void()> conclude_;
  StopWatcher watcher_;
};

/// "interrupted: 3 of 12 judged".
std::string interrupted_line(std::int64_t done, std::int64_t all, const std::string& what);

}  // namespace decant
