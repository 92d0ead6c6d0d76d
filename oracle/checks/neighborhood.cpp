/// \file
/// Distances from one particle to all others: no search by cells for one particle of a failing row.
#include "oracle/checks/neighborhood.hpp"

#include "oracle/checks/comparison.hpp"
#include "reference/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace decant {
namespace {

constexpr std::size_t most_named = 8;

Vec3 place_of(const CheckRow& row) { return {row.worst_x, row.worst_y, row.worst_z}; }

/// Squared distances of all columns from x, m².
Eigen::VectorXd squared_distances(const Domain& domain, const Vec3& x, const Eigen::Matrix3Xd& all) {
  const Separation separation(domain);
  Eigen::VectorXd out(all.cols());
  for (Eigen::Index j = 0; j < all.cols(); ++j) out[j] = separation(x, Vec3(all.col(j))).squaredNorm();
  return out;
}

/// Columns nearer than `radius`, ascending, without `self`.
std::vector<Eigen::Index> nearer(const Eigen::VectorXd& squared, double radius, Eigen::Index self = -1) {
  std::vector<Eigen::Index> found;
  for (Eigen::Index j = 0; j < squared.size(); ++j)
    if (squared[j] < radius * radius && j != self) found.push_back(j);
  return found;
}

void locate(const Fixture& fixture, const PosedWalls& walls, CheckRow& row) {
  const Eigen::Matrix3Xd& fluid = fixture.state.position;
  const Eigen::Matrix3Xd& own = is_of_walls(row) ? walls.position : fluid;
  if (row.worst_id >= own.cols()) return;
  const Vec3 x = own.col(row.worst_id);
  row.worst_x = x.x();
  row.worst_y = x.y();
  row.worst_z = x.z();
  const double H = fixture.scene.support_radius();
  const Eigen::VectorXd to_fluid = squared_distances(fixture.scene.domain, x, fluid);
  const Eigen::VectorXd to_walls = squared_distances(fixture.scene.domain, x, walls.position);
  auto near = nearer(to_fluid, H, is_of_walls(row) ? -1 : row.worst_id);
  row.fluid_neighbors = static_cast<std::int64_t>(near.size());
  row.wall_neighbors = static_cast<std::int64_t>(nearer(to_walls, H, is_of_walls(row) ? row.worst_id : -1).size());
  std::stable_sort(near.begin(), near.end(), [&](Eigen::Index a, Eigen::Index b) { return to_fluid[a] < to_fluid[b]; });
  row.nearest.clear();
  for (std::size_t k = 0; k < std::min(near.size(), most_named); ++k)
    row.nearest += fmt::format("{}{}", k > 0 ? " " : "", near[k]);
}

/// Error, tolerance and score of one particle, where a component scores most.
struct Figures {
  double error = no_number, tolerance = no_number, score = no_number;
};

Figures figures_of(const CheckRow& row, Eigen::Index particle, Eigen::Index particles) {
  Figures worst;
  if (!has_arrays(row) || row.errors.size() % particles != 0) {
    if (particle == row.worst_id) worst = {row.error, row.tolerance, row.score};
    return worst;
  }
  const Eigen::Index components = row.errors.size() / particles;
  for (Eigen::Index k = components * particle; k < components * (particle + 1); ++k) {
    const double score = score_of(row.errors[k], row.tolerances[k]);
    if (!(score <= worst.score)) worst = {row.errors[k], row.tolerances[k], score};
  }
  return worst;
}

}  // namespace

bool is_located(const CheckRow& row) { return !std::isnan(row.worst_x); }

bool is_of_walls(const CheckRow& row) { return row.field == "boundary_volume"; }

void locate(const Fixture& fixture, const Walls& walls, std::vector<CheckRow>& rows) {
  std::optional<PosedWalls> posed;
  for (CheckRow& row : rows) {
    if (verdict_of(row) != Verdict::fail || row.worst_id < 0) continue;
    if (!posed) posed = pose_walls(fixture.scene, walls, fixture.scene.time_at(fixture.state.substep));
    locate(fixture, *posed, row);
  }
}

Neighborhood neighborhood_of(const Fixture& fixture, const Walls& walls, const Eigen::VectorXd& density,
                             const CheckRow& row, std::int64_t index, double radius) {
  const Domain& domain = fixture.scene.domain;
  const PosedWalls posed = pose_walls(fixture.scene, walls, fixture.scene.time_at(fixture.state.substep));
  const Eigen::Matrix3Xd& fluid = fixture.state.position;
  const auto near_fluid = nearer(squared_distances(domain, place_of(row), fluid), radius);
  const auto near_walls = nearer(squared_distances(domain, place_of(row), posed.position), radius);
  const auto n = static_cast<Eigen::Index>(near_fluid.size() + near_walls.size());

  Neighborhood s;
  s.row = index;
  s.spacing = fixture.scene.particle_spacing;
  s.support_radius = fixture.scene.support_radius();
  s.position.resize(3, n);
  s.id.resize(n);
  for (auto* reals : {&s.density, &s.error, &s.tolerance, &s.score}) reals->resize(n);
  Eigen::Index k = 0;
  const auto add = [&](const std::vector<Eigen::Index>& ids, const Eigen::Matrix3Xd& all, bool of_walls) {
    for (const Eigen::Index i : ids) {
      s.position.col(k) = all.col(i);
      s.id[k] = i;
      s.wall.push_back(of_walls);
      s.density[k] = of_walls ? no_number : density[i];
      const Figures figures = of_walls == is_of_walls(row) ? figures_of(row, i, all.cols()) : Figures{};
      s.error[k] = figures.error;
      s.tolerance[k] = figures.tolerance;
      s.score[k] = figures.score;
      ++k;
    }
  };
  add(near_fluid, fluid, false);
  add(near_walls, posed.position, true);
  return s;
}

Reproducer reproducer_of(const Fixture& fixture, const CheckRow& row, double radius) {
  const auto kept = nearer(squared_distances(fixture.scene.domain, place_of(row), fixture.state.position), radius);
  Reproducer reproducer;
  reproducer.fixture.phase = fixture.phase;
  reproducer.fixture.scene = fixture.scene;
  reproducer.fixture.state.substep = fixture.state.substep;
  reproducer.fixture.state.position = fixture.state.position(Eigen::all, kept);
  reproducer.fixture.state.velocity = fixture.state.velocity(Eigen::all, kept);
  reproducer.fixture.provenance = fixture.provenance;
  reproducer.id.resize(static_cast<Eigen::Index>(kept.size()));
  for (std::size_t k = 0; k < kept.size(); ++k) {
    reproducer.id[static_cast<Eigen::Index>(k)] = kept[k];
    if (!is_of_walls(row) && kept[k] == row.worst_id) reproducer.particle = static_cast<std::int64_t>(k);
  }
  return reproducer;
}

}  // namespace decant
