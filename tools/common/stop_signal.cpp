/// \file
/// The one number that a handler may write.
#include "tools/common/stop_signal.hpp"

namespace decant {
namespace {

volatile std::sig_atomic_t caught_signal = 0;

extern "C" void on_signal(int signal) {
  caught_signal = signal;
  // Whichever comes next ends the program.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

}  // namespace

StopSignal::StopSignal() {
  caught_signal = 0;
  struct sigaction action{};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, &before_int_);
  sigaction(SIGTERM, &action, &before_term_);
}

StopSignal::~StopSignal() {
  sigaction(SIGINT, &before_int_, nullptr);
  sigaction(SIGTERM, &before_term_, nullptr);
}

int StopSignal::caught() { return caught_signal; }

}  // namespace decant
