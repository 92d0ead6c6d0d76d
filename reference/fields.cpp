/// \file
/// Density, pressure and acceleration of every particle, term by term as pair_terms.hpp states
/// them.
#include "reference/kernel.hpp"
#include "reference/pair_terms.hpp"
#include "reference/pose.hpp"
#include "reference/solver.hpp"

namespace decant {

PosedWalls pose_walls(const Scene& scene, const Walls& walls, double time) {
  PosedWalls posed;
  posed.position.resize(3, walls.size());
  posed.velocity.resize(3, walls.size());
  Eigen::Index b = 0;
  for (std::size_t c = 0; c < walls.containers.size(); ++c) {
    const Pose pose = pose_at(scene.containers[c], time);
    const auto& local = walls.containers[c].position;
    for (Eigen::Index k = 0; k < local.cols(); ++k, ++b) {
      posed.position.col(b) = pose.to_world(local.col(k));
      posed.velocity.col(b) = pose.velocity_at(posed.position.col(b));
    }
  }
  return posed;
}

WallNeighbors find_wall_neighbors(const Scene& scene, const Walls& walls) {
  WallNeighbors all;
  all.position.resize(3, walls.size());
  Neighbors near;
  for (std::size_t c = 0; c < walls.containers.size(); ++c) {
    const Eigen::Matrix3Xd& x = walls.containers[c].position;
    Scene local = scene;  // the domain as the container's frame sees it
    local.domain.min -= scene.containers[c].origin;
    local.domain.max -= scene.containers[c].origin;
    find_neighbors(local, x, Eigen::Matrix3Xd(3, 0), NeighborSearch::cells, near);
    const auto first = static_cast<std::int32_t>(all.near.size());
    all.position.middleCols(first, x.cols()) = x;
    for (auto& list : near.fluid) {
      for (auto& b : list) b += first;
      all.near.push_back(std::move(list));
    }
  }
  return all;
}

template <class Real>
Eigen::VectorXd boundary_volumes(const Scene& scene, const WallNeighbors& neighbors) {
  const Kernel<Real> kernel(scene.kernel, scene.support_radius());
  const Separation separation(scene.domain);
  const Eigen::Matrix<Real, 3, Eigen::Dynamic> x = neighbors.position.cast<Real>();
  Eigen::VectorXd volumes(x.cols());
  for (Eigen::Index b = 0; b < x.cols(); ++b) {
    Real sum = kernel.W(0);
    for (const auto k : neighbors.near[static_cast<std::size_t>(b)])
      sum += kernel.W(separation(Vector3<Real>(x.col(b)), Vector3<Real>(x.col(k))).norm());
    volumes[b] = static_cast<double>(1 / sum);
  }
  return volumes;
}

template <class Real>
Eigen::VectorXd boundary_volumes(const Scene& scene, const Walls& walls) {
  return boundary_volumes<Real>(scene, find_wall_neighbors(scene, walls));
}

namespace {

std::int64_t sum_of(const std::vector<std::int32_t>& ids) {
  std::int64_t sum = 0;
  for (const auto id : ids) sum += id;
  return sum;
}

}  // namespace

template <class Real>
void evaluate(const Scene& scene, const ParticleState& state, const PosedWalls& walls, const Eigen::VectorXd& volumes,
              const Neighbors& neighbors, Fields& out, const StageInputs* given) {
  using Vector = Vector3<Real>;
  using Matrix = Eigen::Matrix<Real, 3, Eigen::Dynamic>;
  const Kernel<Real> kernel(scene.kernel, scene.support_radius());
  const Separation separation(scene.domain);
  const auto n = state.size();
  const auto m = static_cast<Real>(scene.particle_mass());
  const auto rho0 = static_cast<Real>(scene.fluid.rest_density);
  const auto B = static_cast<Real>(scene.eos_stiffness());
  const auto gamma = static_cast<Real>(scene.fluid.eos_exponent);
  const auto mu = static_cast<Real>(scene.fluid.viscosity);
  const auto mu_w = static_cast<Real>(scene.fluid.wall_viscosity);
  const Vector g = scene.gravity.cast<Real>();
  const Matrix x = state.position.cast<Real>(), v = state.velocity.cast<Real>();
  const Matrix x_wall = walls.position.cast<Real>(), v_wall = walls.velocity.cast<Real>();
  using Column = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  const Column& V = volumes.cast<Real>();  // no copy where Real is double
  const auto fluid_of = [&](Eigen::Index i) -> const auto& { return neighbors.fluid[static_cast<std::size_t>(i)]; };
  const auto wall_of = [&](Eigen::Index i) -> const auto& { return neighbors.wall[static_cast<std::size_t>(i)]; };

  out = Fields::unwritten(n, walls.position.cols());
  out.boundary_volume = volumes;
  Column rho(n), p(n), q(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector x_i = x.col(i);
    Real sum = density_term(m, kernel.W(0));
    for (const auto j : fluid_of(i)) sum += density_term(m, kernel.W(separation(x_i, Vector(x.col(j))).norm()));
    for (const auto b : wall_of(i))
      sum += wall_density_term(rho0, V[b], kernel.W(separation(x_i, Vector(x_wall.col(b))).norm()));
    rho[i] = sum;
    out.density[i] = static_cast<double>(sum);
    if (given && given->density.size()) rho[i] = static_cast<Real>(given->density[i]);
    p[i] = pressure_of(rho[i], rho0, B, gamma, scene.fluid.allow_tension);
    out.pressure[i] = static_cast<double>(p[i]);
    if (given && given->pressure.size()) p[i] = static_cast<Real>(given->pressure[i]);
    q[i] = p[i] / (rho[i] * rho[i]);
    out.fluid_neighbor_count[i] = static_cast<std::int64_t>(fluid_of(i).size());
    out.fluid_neighbor_id_sum[i] = sum_of(fluid_of(i));
    out.wall_neighbor_count[i] = static_cast<std::int64_t>(wall_of(i).size());
    out.wall_neighbor_id_sum[i] = sum_of(wall_of(i));
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector x_i = x.col(i), v_i = v.col(i);
    Vector pressure = Vector::Zero(), viscous = Vector::Zero();
    for (const auto j : fluid_of(i)) {
      const Vector x_ij = separation(x_i, Vector(x.col(j)));
      const Real r = x_ij.norm(), G = kernel.G(r), L = kernel.L(r, G);
      pressure += pressure_term(m, q[i], q[j], G, x_ij);
      viscous += viscous_term(mu, m, rho[i], rho[j], v_i, Vector(v.col(j)), L);
    }
    Vector wall_pressure = Vector::Zero(), wall_viscous = Vector::Zero();
    for (const auto b : wall_of(i)) {
      const Vector x_ib = separation(x_i, Vector(x_wall.col(b)));
      const Real r = x_ib.norm(), G = kernel.G(r), L = kernel.L(r, G);
      wall_pressure += wall_pressure_term(rho0, V[b], q[i], G, x_ib);
      wall_viscous += wall_viscous_term(mu_w, V[b], rho[i], v_i, Vector(v_wall.col(b)), L);
    }
    out.pressure_acceleration.col(i) = pressure.template cast<double>();
    out.viscous_acceleration.col(i) = viscous.template cast<double>();
    out.wall_pressure_acceleration.col(i) = wall_pressure.template cast<double>();
    out.wall_viscous_acceleration.col(i) = wall_viscous.template cast<double>();
    out.acceleration.col(i) = (pressure + viscous + wall_pressure + wall_viscous + g).template cast<double>();
  }
}

template Eigen::VectorXd boundary_volumes<double>(const Scene&, const Walls&);
template Eigen::VectorXd boundary_volumes<float>(const Scene&, const Walls&);
template Eigen::VectorXd boundary_volumes<double>(const Scene&, const WallNeighbors&);
template Eigen::VectorXd boundary_volumes<float>(const Scene&, const WallNeighbors&);
template void evaluate<double>(const Scene&, const ParticleState&, const PosedWalls&, const Eigen::VectorXd&,
                               const Neighbors&, Fields&, const StageInputs*);
template void evaluate<float>(const Scene&, const ParticleState&, const PosedWalls&, const Eigen::VectorXd&,
                              const Neighbors&, Fields&, const StageInputs*);

}  // namespace decant
