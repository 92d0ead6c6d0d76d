/// \file
/// Draws the bar.
#include "tools/common/progress.hpp"

#include <fmt/format.h>

#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace decant {
namespace {

constexpr std::size_t widest_bar = 28, narrowest_bar = 8;
constexpr double seconds_between_draws = 0.2, seconds_between_lines = 30.0;

/// Of the terminal as it is now: it may be resized meanwhile.
std::size_t columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

std::string progress_line(std::size_t columns, double share, const std::string& text) {
  // The last column stays empty: some terminals break the line there.
  const std::size_t room = std::max<std::size_t>(columns, 2) - 1, frame = 3;
  if (text.size() + frame + narrowest_bar > room) return text.substr(0, room);
  const std::size_t bar = std::min(widest_bar, room - text.size() - frame);
  const auto full = static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(bar));
  return fmt::format("[{}{}] {}", std::string(full, '#'), std::string(bar - full, '.'), text);
}

std::string duration_text(double seconds) {
  const auto s = static_cast<std::int64_t>(std::ceil(std::max(seconds, 0.0)));
  if (s >= 3600) return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
  if (s >= 60) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} s", s);
}

Progress::Progress(std::string what, std::int64_t total, std::int64_t done, bool quiet)
    : what_(std::move(what)), total_(total), first_(done), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { pause(); }

void Progress::update(std::int64_t done, const std::string& note, double part) {
  if (quiet_) return;
  const auto now = Clock::now();
  const bool last = done >= total_;
  const double since = std::chrono::duration<double>(now - last_).count();
  if (begun_ && !last && since < (terminal_ ? seconds_between_draws : seconds_between_lines)) return;
  begun_ = true;
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double at = static_cast<double>(done) + part, total = static_cast<double>(total_);
  const double here = at - static_cast<double>(first_), all = total - static_cast<double>(first_);
  std::string left;
  if (last) left = "took " + duration_text(elapsed);
  else if (here > 0) left = duration_text(elapsed * (all - here) / here) + " left";
  const std::string text = fmt::format("{} {}/{}{}{}{}{}", what_, done, total_, left.empty() ? "" : ", ", left,
                                       note.empty() ? "" : ", ", note);
  if (!terminal_) {
    fmt::print(stderr, "{}\n", text);
    return;
  }
  fmt::print(stderr, "\r\x1b[K{}", progress_line(columns(), at / std::max(total, 1.0), text));
  std::fflush(stderr);
  line_open_ = true;
}

void Progress::pause() {
  if (line_open_) fmt::print(stderr, "\n");
  line_open_ = false;
}

}  // namespace decant
