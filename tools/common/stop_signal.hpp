/// \file
/// Ctrl-C and a polite kill, asked for instead of obeyed.
#pragma once

#include <csignal>

namespace decant {

/// As long as this lives, SIGINT and SIGTERM are noted; a second one ends the program.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  /// The signal's number; 0: none yet.
  static int caught();

 private:
  struct sigaction before_int_{}, before_term_{};
};

}  // namespace decant
