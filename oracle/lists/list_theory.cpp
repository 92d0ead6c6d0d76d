/// \file
/// Sums over the pairs near H; integrals over depth from one table per kernel.
#include "oracle/lists/list_theory.hpp"

#include "reference/kernel.hpp"

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

double rms(double squares, double n) { return n > 0 ? std::sqrt(squares / n) : 0; }

/// ∫₀^x of squares of the kernel's functions over depth, at steps of 1/steps.
class EdgeIntegrals {
 public:
  struct Values {
    double WW = 0, GG = 0, LL = 0, GL = 0;  // W², (r G)², L², r G L
  };

  explicit EdgeIntegrals(const Scene& scene) {
    const double H = scene.support_radius();
    const Kernel<double> kernel(scene.kernel, H);
    table_.resize(steps + 1);
    for (std::size_t k = 0; k < steps; ++k) {
      const double r = H * (1 - (static_cast<double>(k) + 0.5) / steps), W = kernel.W(r), G = r * kernel.G(r),
                   L = kernel.L(r);
      Values next = table_[k];
      next.WW += W * W / steps;
      next.GG += G * G / steps;
      next.LL += L * L / steps;
      next.GL += G * L / steps;
      table_[k + 1] = next;
    }
  }

  Values at(double x) const {
    const double place = std::clamp(x, 0.0, 1.0) * steps;
    const auto k = std::min(static_cast<std::size_t>(place), std::size_t{steps - 1});
    const double t = place - static_cast<double>(k);
    const Values &a = table_[k], &b = table_[k + 1];
    return {a.WW + t * (b.WW - a.WW), a.GG + t * (b.GG - a.GG), a.LL + t * (b.LL - a.LL), a.GL + t * (b.GL - a.GL)};
  }

 private:
  static constexpr std::size_t steps = 4096;
  std::vector<Values> table_;
};

ExpectedDrift expected(const EdgeIntegrals& edge, const PairsNearEdge& near, double seconds, double skin) {
  double missed = 0, density = 0, acceleration = 0;
  for (const NearPair& pair : near.pairs) {
    const double x = pair.approach * seconds - skin;
    if (!(x > 0)) continue;
    const auto I = edge.at(x);
    missed += x;
    density += pair.mass * pair.mass * I.WW;
    acceleration += pair.pressure * pair.pressure * I.GG + pair.viscous * pair.viscous * I.LL +
                    2 * pair.pressure * pair.viscous * pair.cosine * I.GL + pair.handed_on * pair.handed_on * I.WW;
  }
  // Each pair in the shell stands for 1/(2 width) pairs a unit of r/H.
  const double each = 1 / (2 * PairsNearEdge::width * std::max(near.particles, 1.0));
  ExpectedDrift drift;
  if (missed == 0) return drift;
  drift.missed_share = missed * each / near.neighbors;
  drift.density_rms = std::sqrt(each * density) / near.density_rms;
  drift.acceleration_rms = std::sqrt(each * acceleration) / near.acceleration_rms;
  return drift;
}

}  // namespace

PairsNearEdge pairs_near_edge(const Scene& scene, const Eigen::VectorXd& volumes, const Instant& now) {
  const double H = scene.support_radius(), m = scene.particle_mass(), rho0 = scene.fluid.rest_density,
               c0 = scene.fluid.sound_speed;
  const Kernel<double> kernel(scene.kernel, H);
  const Separation separation(scene.domain);
  const auto& state = now.state;
  const auto n = state.size();
  Scene wide = scene;
  wide.support_ratio *= 1 + PairsNearEdge::width;
  Neighbors around;
  find_neighbors(wide, state.position, now.walls.position, NeighborSearch::cells, around);

  PairsNearEdge near;
  near.particles = static_cast<double>(n);
  const auto q = [&](Eigen::Index i) {
    return now.fields.pressure[i] / (now.fields.density[i] * now.fields.density[i]);
  };
  // dp/drho is about c0²; where pressure is clamped, density changes nothing.
  const auto stiff = [&](Eigen::Index i) { return now.fields.pressure[i] != 0 ? c0 * c0 / (rho0 * rho0) : 0.0; };
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 x_i = state.position.col(i), v_i = state.velocity.col(i);
    const double rho_i = now.fields.density[i];
    Vec3 own = Vec3::Zero();
    double others = 0;
    const std::size_t first = near.pairs.size();
    const auto take = [&](const Vec3& x_ij, const Vec3& v_ij, double mass, double pressure, double viscous) {
      const double r = x_ij.norm();
      if (r < H) own += mass * kernel.G(r) * x_ij;
      if (r < (1 - PairsNearEdge::width) * H || r == 0) return;
      const double nearing = -v_ij.dot(x_ij) / r, speed = v_ij.norm();
      near.pairs.push_back({nearing / H, mass, pressure, viscous * speed, speed > 0 ? nearing / speed : 0.0, 0.0});
    };
    const auto at = static_cast<std::size_t>(i);
    for (const auto id : around.fluid[at]) {
      const auto j = static_cast<Eigen::Index>(id);
      const Vec3 x_ij = separation(x_i, Vec3(state.position.col(j)));
      take(x_ij, v_i - state.velocity.col(j), m, m * (q(i) + q(j)),
           scene.fluid.viscosity / rho_i * m / now.fields.density[j]);
      if (const double r = x_ij.norm(); r < H) others += std::pow(m * r * kernel.G(r), 2);
    }
    for (const auto id : around.wall[at]) {
      const auto b = static_cast<Eigen::Index>(id);
      take(separation(x_i, Vec3(now.walls.position.col(b))), v_i - now.walls.velocity.col(b), rho0 * volumes[b],
           rho0 * volumes[b] * q(i), scene.fluid.wall_viscosity / rho_i * volumes[b]);
    }
    const double handed_on = stiff(i) * std::sqrt(own.squaredNorm() + others);
    for (std::size_t k = first; k < near.pairs.size(); ++k) near.pairs[k].handed_on = handed_on * near.pairs[k].mass;
    near.neighbors += static_cast<double>(now.near.fluid[at].size() + now.near.wall[at].size());
    const double speed = v_i.norm();
    near.second = std::max(near.second, std::min(speed, near.fastest));
    near.fastest = std::max(near.fastest, speed);
  }
  if (now.walls.velocity.cols() > 0) near.wall_fastest = now.walls.velocity.colwise().norm().maxCoeff();
  near.neighbors /= std::max(near.particles, 1.0);
  near.density_rms = rms(now.fields.density.squaredNorm(), near.particles);
  near.acceleration_rms = rms((now.fields.acceleration - scene.gravity.replicate(1, n)).squaredNorm(), near.particles);
  return near;
}

ExpectedDrift expected_drift(const Scene& scene, const PairsNearEdge& near, double seconds, double skin) {
  return expected(EdgeIntegrals(scene), near, seconds, skin);
}

double skin_for(const Scene& scene, const PairsNearEdge& near, double seconds, double tolerance) {
  const EdgeIntegrals edge(scene);
  const auto within = [&](double skin) { return expected(edge, near, seconds, skin).acceleration_rms <= tolerance; };
  if (within(0)) return 0;
  double low = 0, high = 1;
  for (int k = 0; k < 30; ++k) {
    const double middle = 0.5 * (low + high);
    (within(middle) ? high : low) = middle;
  }
  return high;
}

int expected_safe_interval(const Scene& scene, const PairsNearEdge& near, double skin, bool relative, int longest) {
  double nearing = std::max(near.fastest + near.second, near.fastest + near.wall_fastest) / scene.support_radius();
  if (relative) {
    nearing = 0;
    for (const NearPair& pair : near.pairs) nearing = std::max(nearing, pair.approach);
  }
  const double way = nearing * scene.time_step();
  if (way * (longest - 1) <= skin) return longest;
  return 1 + static_cast<int>(skin / way);
}

std::array<double, 3> edge_powers(const Scene& scene) {
  const bool viscous = scene.fluid.viscosity > 0;
  switch (scene.kernel) {
    case KernelFamily::cubic_spline:
      return {1, 4, 3};
    case KernelFamily::wendland_c2:
      return {1, 5, 4};
    case KernelFamily::mueller2003:
      break;
  }
  return {1, 4, viscous ? 2.0 : 3.0};
}

}  // namespace decant
