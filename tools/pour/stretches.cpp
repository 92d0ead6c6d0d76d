/// \file
/// Arithmetic with whole substeps.
#include "tools/pour/stretches.hpp"

#include "reference/scene_checks.hpp"

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

/// How often walls are looked at between two frames. Paths are followed as straight lines: what moves
/// further than two walls are thick, at the speed to expect, may turn on its way.
std::int64_t looks_per_frame(const Scene& scene) {
  double thinnest = INFINITY;
  for (const Container& container : scene.containers) thinnest = std::min(thinnest, container.wall_thickness);
  const double way =
      expected_max_speed(scene) * scene.time_step() * static_cast<double>(scene.schedule.substeps_per_frame);
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(way / (2 * thinnest))), 1,
                                  scene.schedule.substeps_per_frame);
}

}  // namespace

Stretches::Stretches(const Scene& scene) : all_(scene.schedule.substeps_per_frame), looks_(looks_per_frame(scene)) {}

std::int64_t Stretches::look_of(std::int64_t done) const {
  std::int64_t k = done * looks_ / all_;
  while (look(k) > done) --k;
  while (look(k + 1) <= done) ++k;
  return k;
}

std::int64_t Stretches::end_of(std::int64_t done) const {
  const std::int64_t k = look_of(done), begin = look(k), length = look(k + 1) - begin;
  const std::int64_t parts = (length + longest - 1) / longest;
  for (std::int64_t part = (done - begin) * parts / length;; ++part)
    if (const std::int64_t end = begin + length * part / parts; end > done) return end;
}

bool Stretches::looks_at(std::int64_t done) const { return done == all_ || look(look_of(done)) == done; }

bool Stretches::meet_at(std::int64_t done) const {
  if (looks_at(done)) return true;
  const std::int64_t begin = look(look_of(done));
  return done > begin && end_of(done - 1) == done;
}

}  // namespace decant
