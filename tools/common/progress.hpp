/// \file
/// How far long work has come: a bar with the time left on a terminal, a line now and then
/// elsewhere.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

namespace decant {

/// "3 h 05 min", "2 min 07 s", "41 s". \param seconds  s
std::string duration_text(double seconds);

/// A bar and a text that a terminal of so many columns holds in one line: the bar gives way first, then the text's
/// end. \param share  done of all, 0 … 1
std::string progress_line(std::size_t columns, double share, const std::string& text);

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

  /// \param note  shown behind the bar; \param part  of the step after those done, 0 … 1
  void update(std::int64_t done, const std::string& note = {}, double part = 0);
  /// Ends the bar's line, so that other output can follow; a later update starts a new one.
  void pause();

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  std::int64_t total_, first_;
  bool quiet_, terminal_, begun_ = false, line_open_ = false;
  Clock::time_point start_ = Clock::now(), last_ = start_;
};

}  // namespace decant
