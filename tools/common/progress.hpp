/// \file
/// How far long work has come: a bar with the time left on a terminal, a line now and then
/// elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace decant {

/// "3 h 05 min", "2 min 07 s", "41 s". \param seconds  s
std::string duration_text(double seconds);

/// Reports to standard error.
class Progress {
 public:
  /// \param what  names the steps ("frame"); \param total  steps in all; \param done  steps that an
  /// earlier run did, which say nothing about this run's speed; \param quiet  true: nothing is
  /// shown
  Progress(std::string what, std::int64_t total, std::int64_t done, bool quiet);
  /// Ends the bar's line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// \param note  shown behind the bar
  void update(std::int64_t done, const std::string& note = {});
  /// Ends the bar's line, so that other output can follow; a later update starts a new one.
  void pause();

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  std::int64_t total_, first_;
  bool quiet_, terminal_, line_open_ = false;
  Clock::time_point start_ = Clock::now(), last_ = start_;
};

}  // namespace decant
