/// \file
/// Phases by rule or by time.
#include "tools/common/phases.hpp"

#include "reference/error.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace decant {
namespace {

constexpr std::array<std::pair<const char*, double>, 5> fraction_of_tilt = {
    {{"settled", 0.0}, {"tilt-onset", 0.25}, {"stream", 0.57}, {"splash", 0.65}, {"filling", 0.85}}};

[[noreturn]] void refuse(const std::string& value, const std::string& bound) {
  throw InputError("command line", "--phase", value, bound);
}

}  // namespace

std::vector<std::string> phase_names() {
  std::vector<std::string> names = {"start"};
  for (const auto& [name, fraction] : fraction_of_tilt) names.emplace_back(name);
  names.emplace_back("rest");
  return names;
}

double phase_time(const Scene& scene, const std::string& name) {
  if (name == "start") return 0;
  if (name == "rest") return scene.schedule.end;
  const auto named = std::find_if(fraction_of_tilt.begin(), fraction_of_tilt.end(),
                                  [&](const auto& entry) { return entry.first == name; });
  if (named == fraction_of_tilt.end())
    refuse(name, fmt::format("one of {}, or NAME=TIME", fmt::join(phase_names(), ", ")));
  const auto tilted = std::find_if(scene.containers.begin(), scene.containers.end(),
                                   [](const Container& c) { return c.tilt && c.tilt->keys.size() > 1; });
  if (tilted == scene.containers.end())
    refuse(name, "start or rest, or NAME=TIME: nothing in this scene tilts from key to key");
  const double first = tilted->tilt->keys.front().time, last = tilted->tilt->keys.back().time;
  return std::min(first + named->second * (last - first), scene.schedule.end);
}

Phase parse_phase(const Scene& scene, const std::string& text) {
  const auto equals = text.find('=');
  Phase phase{text.substr(0, equals), 0};
  double time = 0;
  if (equals == std::string::npos) {
    time = phase_time(scene, phase.name);
  } else {
    const char* end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data() + equals + 1, end, time);
    if (error != std::errc() || stopped != end) refuse(text, "NAME=TIME, the time in s");
  }
  const bool fits_a_file_name =
      !phase.name.empty() && phase.name.find('/') == std::string::npos && phase.name[0] != '.';
  if (!fits_a_file_name) refuse(text, "a name that can be part of a file's name");
  if (!(time >= 0 && time <= scene.schedule.end)) refuse(text, fmt::format("a time in 0 … {} s", scene.schedule.end));
  phase.substep = std::llround(time / scene.time_step());
  return phase;
}

std::string phase_file(std::string out, const std::string& phase) {
  const std::string mark = "{phase}";
  if (const auto at = out.find(mark); at != std::string::npos) out.replace(at, mark.size(), phase);
  return out;
}

}  // namespace decant
