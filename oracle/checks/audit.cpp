/// \file
/// Places by cavity and height, penetration by signed distance, crossings by following the straight
/// path between two samples in the container's frame.
///
/// A path counts as a crossing where it runs deeper than a quarter of the wall: the chord of a path
/// that bends around a rim cuts the corner, but far less deep than that between two frames; a path
/// through a wall reaches its middle.
#include "oracle/checks/audit.hpp"

#include "reference/distance.hpp"
#include "reference/neighbors.hpp"
#include "reference/pose.hpp"

#include <cmath>

namespace decant {
namespace {

/// Whether the segment a–b enters the solid deeper than `depth`. The distance changes by at most the
/// way walked, so most segments are settled by their ends.
bool runs_deeper(const SolidDistance& solid, const Vec3& a, double at_a, const Vec3& b, double at_b, double depth) {
  const double length = (b - a).norm();
  if (at_a < -depth || at_b < -depth) return true;
  if (0.5 * (at_a + at_b - length) >= -depth || length < 1e-9) return false;
  const Vec3 middle = 0.5 * (a + b);
  const double at_middle = solid.at(middle).distance;
  return runs_deeper(solid, a, at_a, middle, at_middle, depth) || runs_deeper(solid, middle, at_middle, b, at_b, depth);
}

bool outside(const Domain& domain, const Vec3& x) {
  for (int a = 0; a < 3; ++a)
    if (!domain.periodic[a] && !(x[a] >= domain.min[a] && x[a] <= domain.max[a])) return true;
  return !x.allFinite();
}

}  // namespace

Audit::Audit(const Scene& scene) : scene_(scene), solids_(scene.containers.begin(), scene.containers.end()) {}

AuditResult Audit::sample(const ParticleState& state) {
  AuditResult result;
  const auto n = state.size();
  const double mass = scene_.particle_mass(), time = scene_.time_at(state.substep);
  const Separation separation(scene_.domain);
  result.region.assign(static_cast<std::size_t>(n), static_cast<std::uint8_t>(Region::in_flight));

  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 x = state.position.col(i), v = state.velocity.col(i);
    auto& region = result.region[static_cast<std::size_t>(i)];
    if (scene_.floor && x.z() - scene_.floor->height < scene_.support_radius())
      region = static_cast<std::uint8_t>(Region::spilled);
    if (outside(scene_.domain, x) || !v.allFinite()) region = static_cast<std::uint8_t>(Region::lost);
    result.kinetic_energy += 0.5 * mass * v.squaredNorm();
    result.potential_energy -= mass * scene_.gravity.dot(x);
    // NaN once seen stays.
    if (!(v.norm() <= result.max_speed) && !std::isnan(result.max_speed)) result.max_speed = v.norm();
  }

  bool source_seen = false;
  std::vector<bool> inside(static_cast<std::size_t>(n)), crossed(static_cast<std::size_t>(n));
  for (std::size_t c = 0; c < solids_.size(); ++c) {
    const Container& container = scene_.containers[c];
    const bool is_source = moves(container) && !source_seen;
    source_seen = source_seen || is_source;
    const auto cavity = static_cast<std::uint8_t>(is_source ? Region::source : Region::receiver);
    const Pose pose = pose_at(container, time);
    const Pose pose_before = pose_at(container, scene_.time_at(last_substep_));
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (result.region[k] == static_cast<std::uint8_t>(Region::lost)) continue;
      const Vec3 x = state.position.col(i), local = pose.to_local(x);
      if (solids_[c].in_cavity(local)) result.region[k] = cavity;
      const double distance = solids_[c].at(local).distance;
      if (distance < 0) inside[k] = true;
      if (-distance > result.deepest) {
        result.deepest = -distance;
        result.deepest_particle = i;
      }
      if (last_.cols() != n) continue;
      const Vec3 x_before = x - separation(x, Vec3(last_.col(i)));
      const Vec3 before = pose_before.to_local(x_before);
      if (runs_deeper(solids_[c], before, solids_[c].at(before).distance, local, distance,
                      0.25 * container.wall_thickness))
        crossed[k] = true;
    }
  }
  for (std::size_t k = 0; k < result.region.size(); ++k) {
    ++result.particles_at[result.region[k]];
    result.inside += inside[k];
    result.crossed += crossed[k];
    if (crossed[k] && result.first_crossed < 0) result.first_crossed = static_cast<std::int64_t>(k);
  }
  for (std::size_t p = 0; p < region_names.size(); ++p)
    result.mass_at[p] = mass * static_cast<double>(result.particles_at[p]);
  last_ = state.position;
  last_substep_ = state.substep;
  return result;
}

}  // namespace decant
