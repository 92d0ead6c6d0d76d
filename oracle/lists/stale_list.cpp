/// \file
/// Lists against the truth, pair by pair, and the fields of both.
#include "oracle/lists/stale_list.hpp"

#include "reference/larger.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>

namespace decant {
namespace {

/// Displacements by the nearest image, m: the largest and the second largest.
std::pair<double, double> farthest_two(const Separation& separation, const Eigen::Matrix3Xd& now,
                                       const Eigen::Matrix3Xd& before) {
  double first = 0, second = 0;
  for (Eigen::Index i = 0; i < now.cols(); ++i) {
    const double d = separation(Vec3(now.col(i)), Vec3(before.col(i))).norm();
    second = std::max(second, std::min(d, first));
    first = std::max(first, d);
  }
  return {first, second};
}

template <class Matrix>
FieldDeficit deficit(const Matrix& whole, const Matrix& partial, const Matrix& tolerance) {
  FieldDeficit d;
  const auto error = (whole - partial).eval();
  const auto n = static_cast<double>(std::max<Eigen::Index>(error.cols(), 1));
  // A NaN in any of them makes the result NaN, which no bound admits.
  const double size = whole.squaredNorm();
  d.relative_rms = error.squaredNorm() == 0 ? 0 : std::sqrt(error.squaredNorm() / size);
  d.mean = error.colwise().norm().sum() / n;
  for (Eigen::Index k = 0; k < error.size(); ++k) {
    const double e = std::abs(error.reshaped()[k]);
    if (e == 0) continue;
    d.score = larger(d.score, e / tolerance.reshaped()[k]);
  }
  return d;
}

}  // namespace

Instant instant_of(const Scene& scene, const Walls& walls, const WallSolution& volumes, const ParticleState& state) {
  Instant now;
  now.state = state;
  now.walls = pose_walls(scene, walls, scene.time_at(state.substep));
  find_neighbors(scene, state.position, now.walls.position, NeighborSearch::cells, now.near);
  ReferenceSolution complete = reference_solution(scene, walls, volumes, state);
  now.fields = std::move(complete.fields);
  now.tolerance = std::move(complete.tolerance);
  return now;
}

StaleList::StaleList(const Scene& scene, const Eigen::VectorXd& volumes, const Instant& built, double skin)
    : scene_(scene),
      volumes_(volumes),
      skin_(skin),
      substep_(built.state.substep),
      fluid_(built.state.position),
      wall_(built.walls.position) {
  Scene wide = scene;
  wide.support_ratio *= 1 + skin;
  find_neighbors(wide, fluid_, wall_, NeighborSearch::cells, listed_);
}

StaleList::StaleList(const Scene& scene, const Eigen::VectorXd& volumes, const Instant& built, Neighbors listed)
    : scene_(scene),
      volumes_(volumes),
      skin_(std::numeric_limits<double>::quiet_NaN()),
      substep_(built.state.substep),
      fluid_(built.state.position),
      wall_(built.walls.position),
      listed_(std::move(listed)) {}

void compare_lists(const Separation& separation, double H, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                   const std::vector<std::vector<std::int32_t>>& listed,
                   const std::vector<std::vector<std::int32_t>>& all, std::vector<std::vector<std::int32_t>>& kept,
                   PairCount& count) {
  kept.resize(listed.size());
  std::vector<std::int32_t> lost;
  for (std::size_t i = 0; i < listed.size(); ++i) {
    const Vec3 x = from.col(static_cast<Eigen::Index>(i));
    // Both are ascending, so what is kept is what both hold.
    kept[i].clear();
    std::set_intersection(listed[i].begin(), listed[i].end(), all[i].begin(), all[i].end(),
                          std::back_inserter(kept[i]));
    count.listed += static_cast<std::int64_t>(listed[i].size());
    count.within += static_cast<std::int64_t>(all[i].size());
    if (kept[i].size() == all[i].size()) continue;
    lost.clear();
    std::set_difference(all[i].begin(), all[i].end(), listed[i].begin(), listed[i].end(), std::back_inserter(lost));
    count.missed += static_cast<std::int64_t>(lost.size());
    for (const auto j : lost) count.deepest = std::max(count.deepest, (H - separation(x, Vec3(to.col(j))).norm()) / H);
  }
}

void compare_fields(const Scene& scene, const Instant& now, const Fields& actual, Staleness& out) {
  const Fields &whole = now.fields, &allowed = now.tolerance;
  const auto row = [](const Eigen::VectorXd& v) { return Eigen::RowVectorXd(v.transpose()); };
  out.density = deficit(row(whole.density), row(actual.density), row(allowed.density));
  out.pressure = deficit(row(whole.pressure), row(actual.pressure), row(allowed.pressure));
  const Eigen::Matrix3Xd g = scene.gravity.replicate(1, now.state.size());
  out.acceleration = deficit(Eigen::Matrix3Xd(whole.acceleration - g), Eigen::Matrix3Xd(actual.acceleration - g),
                             allowed.acceleration);
  out.wall_acceleration =
      deficit(Eigen::Matrix3Xd(whole.wall_pressure_acceleration + whole.wall_viscous_acceleration),
              Eigen::Matrix3Xd(actual.wall_pressure_acceleration + actual.wall_viscous_acceleration),
              Eigen::Matrix3Xd(allowed.wall_pressure_acceleration + allowed.wall_viscous_acceleration));
}

Staleness StaleList::at(const Instant& now) const {
  const Separation separation(scene_.domain);
  const double H = scene_.support_radius();
  Staleness s;
  s.age = now.state.substep - substep_;
  std::tie(s.farthest, s.second) = farthest_two(separation, now.state.position, fluid_);
  s.wall_farthest = farthest_two(separation, now.walls.position, wall_).first;
  Neighbors kept;
  compare_lists(separation, H, now.state.position, now.state.position, listed_.fluid, now.near.fluid, kept.fluid,
                s.fluid);
  compare_lists(separation, H, now.state.position, now.walls.position, listed_.wall, now.near.wall, kept.wall, s.wall);
  if (s.fluid.missed + s.wall.missed == 0) return s;
  Fields stale;
  evaluate<double>(scene_, now.state, now.walls, volumes_, kept, stale);
  compare_fields(scene_, now, stale, s);
  return s;
}

}  // namespace decant
