/// \file
/// Pairs of fluid and a few wall particles, all tried: a patch is small.
#include "tools/validation/wall_patch.hpp"

#include "reference/kernel.hpp"
#include "reference/neighbors.hpp"
#include "reference/pair_terms.hpp"
#include "reference/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace decant::validate {
namespace {

/// Length of a row of equally spaced coordinates, each standing for one spacing.
double length_of(std::vector<double> x, double dx) {
  std::sort(x.begin(), x.end());
  std::vector<double> apart;
  for (const double value : x)
    if (apart.empty() || value - apart.back() > 0.1 * dx) apart.push_back(value);
  if (apart.size() < 2)
    throw std::runtime_error(fmt::format("a wall patch needs 2 rows of particles, it has {}", apart.size()));
  const auto n = static_cast<double>(apart.size());
  return (apart.back() - apart.front()) * n / (n - 1);
}

}  // namespace

WallPatch::WallPatch(const Scene& scene, const Walls& walls, const SolidBox& box, const Vec3& normal)
    : scene_(scene), normal_(normal) {
  const PosedWalls posed = pose_walls(scene, walls, 0);
  for (Eigen::Index b = 0; b < posed.position.cols(); ++b) {
    const Vec3 x = posed.position.col(b);
    if ((x.array() >= box.min.array()).all() && (x.array() <= box.max.array()).all()) ids_.push_back(b);
  }
  if (ids_.empty()) throw std::runtime_error("a wall patch holds no wall particles");
  position_.resize(3, static_cast<Eigen::Index>(ids_.size()));
  double nearest = INFINITY;
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    position_.col(static_cast<Eigen::Index>(k)) = posed.position.col(ids_[k]);
    nearest = std::min(nearest, posed.position.col(ids_[k]).dot(normal));
  }
  low_ = position_.rowwise().minCoeff();
  high_ = position_.rowwise().maxCoeff();
  area_ = 1;
  for (int a = 0; a < 3; ++a) {
    if (std::abs(normal[a]) > 0.5) continue;
    std::vector<double> face;
    for (Eigen::Index k = 0; k < position_.cols(); ++k)
      if (position_.col(k).dot(normal) < nearest + 0.5 * scene.particle_spacing) face.push_back(position_(a, k));
    area_ *= length_of(std::move(face), scene.particle_spacing);
  }
}

double WallPatch::pressure(const ParticleState& state, const Fields& fields) const {
  const double H = scene_.support_radius(), m = scene_.particle_mass(), rho0 = scene_.fluid.rest_density;
  const Kernel<double> kernel(scene_.kernel, H);
  double force = 0;
  for (Eigen::Index i = 0; i < state.size(); ++i) {
    const Vec3 x = state.position.col(i);
    if ((x.array() < low_.array() - H).any() || (x.array() > high_.array() + H).any()) continue;
    const double q = fields.pressure[i] / (fields.density[i] * fields.density[i]);
    for (Eigen::Index k = 0; k < position_.cols(); ++k) {
      const Vec3 x_ib = x - position_.col(k);
      const double r = x_ib.norm();
      if (!(r < H)) continue;
      const double V = fields.boundary_volume[ids_[static_cast<std::size_t>(k)]];
      force -= m * wall_pressure_term(rho0, V, q, kernel.G(r), x_ib).dot(normal_);
    }
  }
  return force / area_;
}

}  // namespace decant::validate
