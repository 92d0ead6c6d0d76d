/// \file
/// Wall particle by wall particle.
#include "oracle/solution/pose_error.hpp"

#include "reference/pose.hpp"

#include <algorithm>

namespace decant {
namespace {

/// |a| × |b| with plus signs: what a cross product is rounded by.
Vec3 cross_size(const Vec3& a, const Vec3& b) {
  const Vec3 p = a.cwiseAbs(), q = b.cwiseAbs();
  return {p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(), p.x() * q.y() + p.y() * q.x()};
}

Vec3 tilting_error(const Container& container, const Pose& pose, const Vec3& local, const Vec3& x) {
  const Vec3 before = container.tilt->pivot;
  const Vec3 untilted = local + container.origin, lever = untilted - before;
  const Vec3 by_translation = Vec3::Constant(8 * local.norm()) + pose.translation.cwiseAbs() + x.cwiseAbs();
  const Vec3 by_pivot =
      Vec3::Constant(9 * lever.norm() + untilted.norm() + before.norm()) + pose.pivot.cwiseAbs() + x.cwiseAbs();
  return by_translation.cwiseMax(by_pivot);
}

}  // namespace

PoseErrors pose_errors(const Scene& scene, const Walls& walls, const PosedWalls& posed, double time, double u) {
  PoseErrors e;
  e.position.resize(3, walls.size());
  e.velocity.resize(3, walls.size());
  e.largest.resize(walls.size());
  Eigen::Index b = 0;
  for (std::size_t c = 0; c < walls.containers.size(); ++c) {
    const Container& container = scene.containers[c];
    const Pose pose = pose_at(container, time);
    const auto& all_local = walls.containers[c].position;
    for (Eigen::Index k = 0; k < all_local.cols(); ++k, ++b) {
      const Vec3 local = all_local.col(k), x = posed.position.col(b), v = posed.velocity.col(b);
      e.position.col(b) =
          u * (container.tilt ? tilting_error(container, pose, local, x) : pose.translation.cwiseAbs() + x.cwiseAbs());
      const Vec3 lever = x - pose.pivot;
      const Vec3 misplaced = e.position.col(b) + u * pose.pivot.cwiseAbs();
      e.velocity.col(b) =
          4 * u * cross_size(pose.angular_velocity, lever) + cross_size(pose.angular_velocity, misplaced) +
          u * (v.cwiseAbs() + 2 * pose.linear_velocity.cwiseAbs() + 2 * pose.surface_velocity.cwiseAbs());
      e.largest[b] = std::max({x.cwiseAbs().maxCoeff(), local.norm(), pose.translation.cwiseAbs().maxCoeff()});
    }
  }
  return e;
}

}  // namespace decant
