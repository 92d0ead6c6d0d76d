/// \file
/// The named moments of a pour at which fixtures are recorded.
#pragma once

#include "reference/scene.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace decant {

struct Phase {
  std::string name;
  std::int64_t substep = 0;
};

/// Names with a default time, in the order of a pour.
std::vector<std::string> phase_names();

/// When a phase is, s. With t0 and t1 the first and last key of the first tilted container's
/// schedule and T the scene's end:
///
///   start 0 · settled t0 · tilt-onset t0 + 0.25 (t1 − t0) · stream t0 + 0.57 (t1 − t0) ·
///   splash t0 + 0.65 (t1 − t0) · filling t0 + 0.85 (t1 − t0) · rest T
///
/// The smoothstep has then done 16 %, 60 %, 72 % and 94 % of the turn: in the standard pour the
/// water has left its level, runs as a stream, has just met the receiver's bottom, and fills it.
/// Throws InputError for an unknown name, or where a phase needs a tilt that the scene lacks.
double phase_time(const Scene& scene, const std::string& name);

/// A phase as the command line gives it: "NAME=TIME" (s) or "NAME"; the nearest substep is taken.
/// Throws InputError where the time is no number or outside 0 … T.
Phase parse_phase(const Scene& scene, const std::string& text);

/// The output's name with `{phase}` replaced.
std::string phase_file(std::string out, const std::string& phase);

}  // namespace decant
