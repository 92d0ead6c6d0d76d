/// \file
/// Arithmetic with whole substeps.
#include "tools/pour/segments.hpp"

#include "reference/scene_checks.hpp"

#include <algorithm>
#include <cmath>

namespace decant::pour {
namespace {

/// How often walls are looked at between two frames. Paths are followed as straight lines: what moves
/// further than two walls are thick, at the speed to expect, may turn on its way.
std::int64_t samples_per_frame(const Scene& scene) {
  double thinnest = INFINITY;
  for (const Container& container : scene.containers) thinnest = std::min(thinnest, container.wall_thickness);
  const double way =
      expected_max_speed(scene) * scene.time_step() * static_cast<double>(scene.schedule.substeps_per_frame);
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(way / (2 * thinnest))), 1,
                                  scene.schedule.substeps_per_frame);
}

}  // namespace

Segments::Segments(const Scene& scene) : all_(scene.schedule.substeps_per_frame), samples_(samples_per_frame(scene)) {}

std::int64_t Segments::sample_of(std::int64_t done) const {
  std::int64_t k = done * samples_ / all_;
  while (sample(k) > done) --k;
  while (sample(k + 1) <= done) ++k;
  return k;
}

std::int64_t Segments::end_of(std::int64_t done) const {
  const std::int64_t k = sample_of(done), begin = sample(k), length = sample(k + 1) - begin;
  const std::int64_t parts = (length + longest - 1) / longest;
  for (std::int64_t part = (done - begin) * parts / length;; ++part)
    if (const std::int64_t end = begin + length * part / parts; end > done) return end;
}

bool Segments::samples_at(std::int64_t done) const { return done == all_ || sample(sample_of(done)) == done; }

bool Segments::meet_at(std::int64_t done) const {
  if (samples_at(done)) return true;
  const std::int64_t begin = sample(sample_of(done));
  return done > begin && end_of(done - 1) == done;
}

}  // namespace decant::pour
