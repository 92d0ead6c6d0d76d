/// \file
/// What single precision makes of places and velocities that are not inputs: wall particles posed in the
/// world, images across a period, and frames of cells.
///
/// The pose is an input in double: rotation R, translation t, pivot p, angular velocity omega, linear velocity
/// and surface velocity. A port rounds each of them to fp32. What it may do with them, l the local position, o
/// the container's origin, P the tilt's pivot as the scene has it, which p is where the container is not
/// translated, x the place in the world, a = l + o − P the lever:
///
///   x = R l + t              8 u |l| + u |t_c| + u |x_c|
///   x = p + R (l + o − P)    8 u |a| + u (|l + o| + |P| + |a|) + u |p_c| + u |x_c|
///
/// by component c, |·| the 2-norm. 8: a matrix costs 4 (its entries, the products, two additions; a row's
/// norm is 1), a unit quaternion rounded to fp32, l + 2w (q × l) + 2 q × (q × l), up to 8. Differences are
/// rounded before they are rotated. e_b is the larger of the two. Containers without a tilt have
/// R = 1: x = l + t, u |t_c| + u |x_c|.
#pragma once

#include "reference/scene.hpp"
#include "reference/solver.hpp"
#include "reference/state.hpp"

#include <Eigen/Dense>

namespace decant {

struct PoseErrors {
  Eigen::Matrix3Xd position;  // e_b, m
  /// 4 u (|omega| × |x_b − p|)_c + (|omega| × (e_b + u|p|))_c + u |v_c| + 2 u (|linear_c| + |surface_c|), m/s,
  /// all products by magnitude.
  Eigen::Matrix3Xd velocity;
  /// X_b, m: the largest magnitude among |x_c|, |t_c| and the 2-norm |l|. What `/condition/density_pose`
  /// of fixtures is made with.
  Eigen::VectorXd largest;
};

/// \param posed  of `walls` at `time` (s)
PoseErrors pose_errors(const Scene& scene, const Walls& walls, const PosedWalls& posed, double time, double u);

/// Error of x_i − x_j by component c, m, where neither place is rounded itself:
///
///   u H for each of the two with |x_c| < H: a frame relative to the center of a cell, up to 2 H wide and a
///     power of two, is exact but in the cells at 0, whose places have finer grids than what is left of them;
///   u (3 |k L| + |k| (|low_c| + |high_c|) + |x_i,c| + |x_ij,c|) where the nearest image is k ≠ 0 periods away: L is
///     rounded, or the difference of the rounded ends of the domain, and x_j may be moved by it.
///
/// \param x_ij  by the nearest image; \param H  support radius, m
inline Vec3 pair_error(const Vec3& x_i, const Vec3& x_j, const Vec3& x_ij, const Domain& domain, double H, double u) {
  Vec3 e;
  for (int c = 0; c < 3; ++c) {
    e[c] = u * H * ((std::abs(x_i[c]) < H ? 1 : 0) + (std::abs(x_j[c]) < H ? 1 : 0));
    const double way = std::abs(x_i[c] - x_j[c] - x_ij[c]);
    // Without a period the difference is the same bit for bit.
    if (way == 0) continue;
    const double low = domain.min[c], high = domain.max[c];
    e[c] += u * (way * (3 + (std::abs(low) + std::abs(high)) / (high - low)) + std::abs(x_i[c]) + std::abs(x_ij[c]));
  }
  return e;
}

/// How far r = |x| is off where its components are off by e: e · |x|/|x|, m.
inline double error_along(const Vec3& x, double r, const Vec3& e) {
  if (e.x() == 0 && e.y() == 0 && e.z() == 0) return 0;
  return r > 0 ? x.cwiseAbs().dot(e) / r : e.norm();
}

}  // namespace decant
