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

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

// Particles that one task looks at. Sums are taken by chunk, so that they do not depend on the number of threads.
constexpr Eigen::Index particles_per_chunk = 1024;

/// What is found in one chunk.
struct Chunk {
  double kinetic_energy = 0, potential_energy = 0;  // J
  double max_speed_squared = 0;                     // m²/s²
  struct Deepest {
    double depth = 0;  // m
    std::int64_t particle = -1;
  };
  std::vector<Deepest> deepest;  // by container
};

/// A container where it stands, and where it stood at the sample before.
struct Placed {
  const SolidDistance& solid;
  Pose pose, before;
  std::uint8_t cavity;  // Region
  bool revolved;
  double crossing_depth;  // m, of a path in the solid
};

/// Whether the segment a–b enters the solid deeper than `depth`; one that does by less than a 64th of it may not count,
/// or a path along a wall at just that depth would be looked at point by point. The distance changes by at most the way
/// walked, so most segments are settled by their ends.
bool runs_deeper(const SolidDistance& solid, const Vec3& a, double at_a, const Vec3& b, double at_b, double depth) {
  const double length = (b - a).norm();
  if (at_a < -depth || at_b < -depth) return true;
  if (!(0.5 * (at_a + at_b - length) < -depth * (1 + 1.0 / 64))) return false;
  const Vec3 middle = 0.5 * (a + b);
  const double at_middle = solid.at(middle).distance;
  return runs_deeper(solid, a, at_a, middle, at_middle, depth) || runs_deeper(solid, middle, at_middle, b, at_b, depth);
}

/// NaN once seen stays.
double larger_or_nan(double a, double b) { return std::isnan(a) || b <= a ? a : b; }

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
  const bool follows = last_.cols() == n;
  result.region.assign(static_cast<std::size_t>(n), static_cast<std::uint8_t>(Region::in_flight));

  std::vector<Placed> containers;
  bool source_seen = false;
  for (std::size_t c = 0; c < solids_.size(); ++c) {
    const Container& container = scene_.containers[c];
    const bool is_source = moves(container) && !source_seen;
    source_seen = source_seen || is_source;
    containers.push_back({solids_[c], pose_at(container, time), pose_at(container, scene_.time_at(last_substep_)),
                          static_cast<std::uint8_t>(is_source ? Region::source : Region::receiver),
                          std::holds_alternative<RevolvedShape>(container.shape), 0.25 * container.wall_thickness});
  }

  // Not of bool, whose elements share bytes.
  std::vector<std::uint8_t> inside(static_cast<std::size_t>(n)), crossed(static_cast<std::size_t>(n));
  const auto sample_particle = [&](Eigen::Index i, Chunk& chunk) {
    const Vec3 x = state.position.col(i), v = state.velocity.col(i);
    const auto k = static_cast<std::size_t>(i);
    auto& region = result.region[k];
    if (scene_.floor && x.z() - scene_.floor->height < scene_.support_radius())
      region = static_cast<std::uint8_t>(Region::spilled);
    if (outside(scene_.domain, x) || !v.allFinite()) region = static_cast<std::uint8_t>(Region::lost);
    const double squared = v.squaredNorm();
    chunk.kinetic_energy += 0.5 * mass * squared;
    chunk.potential_energy -= mass * scene_.gravity.dot(x);
    chunk.max_speed_squared = larger_or_nan(chunk.max_speed_squared, squared);
    if (region == static_cast<std::uint8_t>(Region::lost)) return;
    const Vec3 x_before = follows ? Vec3(x - separation(x, Vec3(last_.col(i)))) : x;
    for (std::size_t c = 0; c < containers.size(); ++c) {
      const Placed& at = containers[c];
      const Vec3 local = at.pose.to_local(x);
      const Vec3 before = follows ? at.before.to_local(x_before) : local;
      const double length = (local - before).norm();
      const bool near = at.solid.may_be_within(0, local);
      if ((near || !at.revolved) && at.solid.in_cavity(local)) region = at.cavity;
      if (!near && !at.solid.may_be_within(length, local)) continue;
      const double distance = at.solid.at(local).distance;
      if (distance < 0) inside[k] = 1;
      if (-distance > chunk.deepest[c].depth) chunk.deepest[c] = {-distance, i};
      // Along the path the distance differs from this one by no more than the path's length.
      if (!(distance - length < -at.crossing_depth) || !follows) continue;
      if (runs_deeper(at.solid, before, at.solid.at(before).distance, local, distance, at.crossing_depth))
        crossed[k] = 1;
    }
  };

  std::vector<Chunk> chunks(static_cast<std::size_t>((n + particles_per_chunk - 1) / particles_per_chunk));
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
    chunks[c].deepest.resize(containers.size());
    const Eigen::Index first = static_cast<Eigen::Index>(c) * particles_per_chunk;
    for (Eigen::Index i = first; i < std::min(n, first + particles_per_chunk); ++i) sample_particle(i, chunks[c]);
  });

  double squared = 0;
  for (const Chunk& chunk : chunks) {
    result.kinetic_energy += chunk.kinetic_energy;
    result.potential_energy += chunk.potential_energy;
    squared = larger_or_nan(squared, chunk.max_speed_squared);
  }
  result.max_speed = std::sqrt(squared);
  for (std::size_t c = 0; c < containers.size(); ++c)
    for (const Chunk& chunk : chunks)
      if (chunk.deepest[c].depth > result.deepest) {
        result.deepest = chunk.deepest[c].depth;
        result.deepest_particle = chunk.deepest[c].particle;
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
