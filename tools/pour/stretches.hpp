/// \file
/// Where a pour stops inside a frame: to look at walls, and to ask whether it is to end.
#pragma once

#include "reference/scene.hpp"

#include <cstdint>

namespace decant {

/// The stretches of a frame, one `advance` each. They follow from the scene alone: neighbor lists begin
/// anew with each of them, so that a pour which is resumed at the end of any of them has the bits of one
/// that was never stopped.
class Stretches {
 public:
  /// Substeps of the longest one.
  static constexpr std::int64_t longest = 100;

  explicit Stretches(const Scene& scene);

  /// Substeps into the frame at which the stretch ends that begins `done` into it.
  std::int64_t end_of(std::int64_t done) const;
  /// Whether walls are looked at there.
  bool looks_at(std::int64_t done) const;
  /// Whether a stretch begins or ends there.
  bool meet_at(std::int64_t done) const;
  std::int64_t substeps() const { return all_; }

 private:
  /// Where look k ends; 0 begins the frame.
  std::int64_t look(std::int64_t k) const { return all_ * k / looks_; }
  /// The look that a substep belongs to.
  std::int64_t look_of(std::int64_t done) const;

  std::int64_t all_, looks_;
};

}  // namespace decant
