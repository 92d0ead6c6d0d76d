/// \file
/// Where a pour stops inside a frame: to look at walls, and to ask whether it is to end.
#pragma once

#include "reference/scene.hpp"

#include <cstdint>

namespace decant::pour {

/// The segments of a frame, one `advance` each. They follow from the scene alone: neighbor lists begin
/// anew with each of them, so that a pour which is resumed at the end of any of them has the bits of one
/// that was never stopped.
class Segments {
 public:
  /// Substeps of the longest one.
  static constexpr std::int64_t longest = 100;

  explicit Segments(const Scene& scene);

  /// Substeps into the frame at which the segment ends that begins `done` into it.
  std::int64_t end_of(std::int64_t done) const;
  /// Whether walls are looked at there.
  bool samples_at(std::int64_t done) const;
  /// Whether a segment begins or ends there.
  bool meet_at(std::int64_t done) const;
  std::int64_t substeps() const { return all_; }

 private:
  /// Where look k ends; 0 begins the frame.
  std::int64_t sample(std::int64_t k) const { return all_ * k / samples_; }
  /// The look that a substep belongs to.
  std::int64_t sample_of(std::int64_t done) const;

  std::int64_t all_, samples_;
};

}  // namespace decant::pour
