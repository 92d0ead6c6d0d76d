/// \file
/// Draws the bar.
#include "tools/common/progress.hpp"

#include <fmt/format.h>

#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace decant {
namespace {

constexpr int bar_width = 28;
constexpr double seconds_between_draws = 0.2, seconds_between_lines = 30.0;

}  // namespace

std::string duration_text(double seconds) {
  const auto s = static_cast<std::int64_t>(std::ceil(std::max(seconds, 0.0)));
  if (s >= 3600) return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
  if (s >= 60) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} s", s);
}

Progress::Progress(std::string what, std::int64_t total, std::int64_t done, bool quiet)
    : what_(std::move(what)), total_(total), first_(done), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { pause(); }

void Progress::update(std::int64_t done, const std::string& note) {
  if (quiet_) return;
  const auto now = Clock::now();
  const bool first = done <= first_, last = done >= total_;
  const double since = std::chrono::duration<double>(now - last_).count();
  if (!first && !last && since < (terminal_ ? seconds_between_draws : seconds_between_lines)) return;
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  std::string left;
  if (last) left = "took " + duration_text(elapsed);
  else if (!first)
    left = duration_text(elapsed * static_cast<double>(total_ - done) / static_cast<double>(done - first_)) + " left";
  const std::string text = fmt::format("{} {}/{}{}{}{}{}", what_, done, total_, left.empty() ? "" : ", ", left,
                                       note.empty() ? "" : ", ", note);
  if (!terminal_) {
    fmt::print(stderr, "{}\n", text);
    return;
  }
  const auto full = static_cast<std::size_t>(done * bar_width / std::max<std::int64_t>(total_, 1));
  fmt::print(stderr, "\r\x1b[K[{}{}] {}", std::string(full, '#'),
             std::string(bar_width - std::min<std::size_t>(full, bar_width), '.'), text);
  std::fflush(stderr);
  line_open_ = true;
}

void Progress::pause() {
  if (line_open_) fmt::print(stderr, "\n");
  line_open_ = false;
}

}  // namespace decant
