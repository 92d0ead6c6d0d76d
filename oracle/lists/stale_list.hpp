/// \file
/// What a neighbor list that was built some substeps ago no longer holds, and what that does to the
/// fields: measured in double at the positions of now, so that what lies below fp32's own noise shows
/// too. The list is the oracle's own; no backend's is asked.
///
/// Legend: H support radius, skin a share of H, D displacement since the build, deepest (H − r)/H of
/// a pair that is missed.
#pragma once

#include "oracle/solution/tolerance.hpp"
#include "reference/neighbors.hpp"
#include "reference/solver.hpp"

#include <cstdint>

namespace decant {

/// Pairs of one kind, fluid with fluid or fluid with wall; both directions of a fluid pair count.
struct PairCount {
  std::int64_t within = 0;  // closer than H now
  std::int64_t listed = 0;  // that a pass over the list has to look at
  std::int64_t missed = 0;  // within, and not in the list
  double deepest = 0;       // (H − r)/H of the deepest one missed
};

/// Keeps of the listed pairs those closer than H now, and counts against all that are; adds to `count`. All lists are
/// ascending. \param H  m; \param from, to  3×n, m
void compare_lists(const Separation& separation, double H, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                   const std::vector<std::vector<std::int32_t>>& listed,
                   const std::vector<std::vector<std::int32_t>>& all, std::vector<std::vector<std::int32_t>>& kept,
                   PairCount& count);

/// How far one field is from the one with all pairs.
struct FieldDeficit {
  double relative_rms = 0;  // RMS of the error over RMS of the field
  double mean = 0;          // of |error|, in the field's unit
  double score = 0;         // largest |error| over what fp32 is allowed
};

/// One list at one instant.
struct Staleness {
  std::int64_t age = 0;  // substeps since the build
  PairCount fluid, wall;
  double farthest = 0, second = 0;               // m, the two largest displacements of fluid since the build
  double wall_farthest = 0;                      // m, the largest one of a wall particle
  FieldDeficit density, pressure, acceleration;  // of all terms but gravity
  FieldDeficit wall_acceleration;                // of the wall's terms alone

  /// No pair can be missed: two particles, or a particle and a wall, cannot have come nearer to each
  /// other by more than they moved. Source: Verlet, Phys. Rev. 159 (1967).
  /// \param skin  share of H; \param H  m
  bool provably_complete(double skin, double H) const {
    return farthest + second <= skin * H && farthest + wall_farthest <= skin * H;
  }
};

/// Everything that is the same for all lists looked at in one instant.
struct Instant {
  ParticleState state;
  PosedWalls walls;
  Neighbors near;    // all pairs within H
  Fields fields;     // from them
  Fields tolerance;  // of a backend in fp32
};

/// How far fields at an instant's state are from it. Pairs and displacements stay as they are.
void compare_fields(const Scene& scene, const Instant& now, const Fields& actual, Staleness& out);

/// The oracle's view of a state. \param volumes  of the wall particles
Instant instant_of(const Scene& scene, const Walls& walls, const WallSolution& volumes, const ParticleState& state);

/// The list of pairs closer than (1 + skin) H at its build.
class StaleList {
 public:
  /// \param skin  share of H, >= 0
  StaleList(const Scene& scene, const Eigen::VectorXd& volumes, const Instant& built, double skin);
  /// A given one, of unknown skin (NaN). \param listed  every list ascending
  StaleList(const Scene& scene, const Eigen::VectorXd& volumes, const Instant& built, Neighbors listed);

  /// What it misses at a later instant of the same run.
  Staleness at(const Instant& now) const;

  double skin() const { return skin_; }

 private:
  Scene scene_;
  Eigen::VectorXd volumes_;
  double skin_;
  std::int64_t substep_;
  Eigen::Matrix3Xd fluid_, wall_;  // m, at the build
  Neighbors listed_;
};

}  // namespace decant
