/// \file
/// Boundary volumes and their tolerances: of rigid walls, whatever the fluid does.
#include "oracle/solution/force_bounds.hpp"
#include "oracle/solution/pose_error.hpp"
#include "oracle/solution/sum_bound.hpp"
#include "reference/kernel.hpp"
#include "reference/solver.hpp"

#include <cmath>

namespace decant {
namespace {

Eigen::VectorXd volume_tolerances(const Scene& scene, const WallNeighbors& neighbors, const Eigen::VectorXd& volumes) {
  const Kernel<double> kernel(scene.kernel, scene.support_radius());
  const Separation separation(scene.domain);
  const double H = scene.support_radius();
  const double own = of_density_term - 1 + CommonRoundings(scene.kernel).W;  // no mass
  const Eigen::Matrix3Xd& x = neighbors.position;
  Eigen::VectorXd tolerance(x.cols());
  SumBound sum;
  CellCounter cells;
  for (Eigen::Index b = 0; b < x.cols(); ++b) {
    const auto& near = neighbors.near[static_cast<std::size_t>(b)];
    sum.clear();
    sum.add(kernel.W(0));
    double inside = own * kernel.W(0), by_H = -3 * kernel.W(0);
    for (const auto k : near) {
      const Vec3 x_b = x.col(b), x_k = x.col(k), x_bk = separation(x_b, x_k);
      const double r = x_bk.norm(), W = kernel.W(r), slope = kernel.slope_W(r);
      sum.add(W);
      by_H += r * slope - 3 * W;
      inside += own * W + of_distance * r * slope +
                slope * error_along(x_bk, r, pair_error(x_b, x_k, x_bk, scene.domain, H, 1.0));
    }
    tolerance[b] =
        volumes[b] * volumes[b] * sum.error(both_roundoffs, both_roundoffs * (inside + std::abs(by_H)), cells) +
        2 * both_roundoffs * volumes[b];
  }
  return tolerance;
}

}  // namespace

WallSolution wall_solution(const Scene& scene, const Walls& walls) {
  const WallNeighbors neighbors = find_wall_neighbors(scene, walls);
  WallSolution a;
  a.volume = boundary_volumes<double>(scene, neighbors);
  a.tolerance = volume_tolerances(scene, neighbors, a.volume);
  a.fp32_volume = boundary_volumes<float>(scene, neighbors);
  return a;
}

}  // namespace decant
