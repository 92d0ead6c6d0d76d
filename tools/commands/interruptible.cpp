/// \file
/// How interrupted work ends.
#include "tools/commands/interruptible.hpp"

#include "tools/commands/commands.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

namespace decant {

Interruptible::Interruptible(std::function<void()> conclude)
    : conclude_(std::move(conclude)), watcher_([] { return StopSignal::caught() != 0; }, [this] { leave(); }) {}

void Interruptible::leave() {
  int status = exit_status();
  try {
    conclude_();
  } catch (const std::exception& error) {
    fmt::print(stderr, "decant: {}\n", error.what());
    status = exit_failure;
  }
  std::fflush(nullptr);
  // Threads are still at work on the part that was given up.
  std::_Exit(status);
}

std::string interrupted_line(std::int64_t done, std::int64_t all, const std::string& what) {
  return fmt::format("interrupted: {} of {} {}", done, all, what);
}

}  // namespace decant
