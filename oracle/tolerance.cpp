/// \file
/// One pass for boundary volumes, one for density and pressure, one for accelerations, each beside
/// the oracle's own; the passes mirror the formulas in tolerance.hpp.
#include "oracle/tolerance.hpp"

#include "reference/kernel.hpp"
#include "reference/pair_terms.hpp"
#include "reference/pose.hpp"
#include "reference/solver.hpp"

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

constexpr double u = unit_roundoff;

double growth(std::size_t terms, double c) {
  return (std::sqrt(static_cast<double>(terms)) + c) * u;
}

/// X_b of every wall particle, m.
Eigen::VectorXd pose_magnitudes(const Scene& scene, const Walls& walls, const PosedWalls& posed,
                                double time) {
  Eigen::VectorXd X(walls.size());
  Eigen::Index b = 0;
  for (std::size_t c = 0; c < walls.containers.size(); ++c) {
    const Pose pose = pose_at(scene.containers[c], time);
    const auto& local = walls.containers[c].position;
    for (Eigen::Index k = 0; k < local.cols(); ++k, ++b)
      X[b] = std::max({posed.position.col(b).cwiseAbs().maxCoeff(), local.col(k).norm(),
                       pose.translation.cwiseAbs().maxCoeff()});
  }
  return X;
}

Eigen::VectorXd volume_tolerances(const Scene& scene, const WallNeighbors& neighbors,
                                  const Eigen::VectorXd& volumes) {
  const Kernel<double> kernel(scene.kernel, scene.support_radius());
  const Separation separation(scene.domain);
  const Eigen::Matrix3Xd& x = neighbors.position;
  Eigen::VectorXd tolerance(x.cols());
  for (Eigen::Index b = 0; b < x.cols(); ++b) {
    const auto& near = neighbors.near[static_cast<std::size_t>(b)];
    double sum = kernel.W(0);
    for (const auto k : near) {
      const double r = separation(Vec3(x.col(b)), Vec3(x.col(k))).norm();
      sum += kernel.W(r) + r * kernel.slope_W(r);
    }
    tolerance[b] = volumes[b] * volumes[b] * growth(near.size() + 1, 6) * sum + 2 * u * volumes[b];
  }
  return tolerance;
}

/// What the accelerations' tolerances are made of, for one particle, by component.
struct ForceBounds {
  Vec3 condition = Vec3::Zero();  // Σ |t|(1 + κ)
  Vec3 pose = Vec3::Zero();       // Σ |∂t/∂x_b| X_b
  Vec3 inputs = Vec3::Zero();     // from tau(V_b) and, for viscosity, tau_rho
  Vec3 squares = Vec3::Zero();    // Σ (m tau_q,j G x_c)²
  Vec3 gradient = Vec3::Zero();   // Σ m G x_c or Σ rho0 V_b G x_c, signed

  Vec3 tolerance(double growth_factor, double tau_q) const {
    return growth_factor * (condition + pose) + inputs + squares.cwiseSqrt() +
           2 * tau_q * gradient.cwiseAbs();
  }
  ForceBounds& operator+=(const ForceBounds& o) {
    condition += o.condition;
    pose += o.pose;
    inputs += o.inputs;
    squares += o.squares;
    gradient += o.gradient;
    return *this;
  }
};

class Bounds {
 public:
  Bounds(const Scene& scene, const Walls& walls, const WallAnswer& volumes,
         const ParticleState& state, const StageInputs* given)
      : scene_(scene),
        state_(state),
        given_(given),
        kernel_(scene.kernel, scene.support_radius()),
        separation_(scene.domain),
        posed_(pose_walls(scene, walls, scene.time_at(state.substep))),
        X_(pose_magnitudes(scene, walls, posed_, scene.time_at(state.substep))) {
    OracleAnswer& a = answer_;
    find_neighbors(scene, state.position, posed_.position, NeighborSearch::cells, near_);
    evaluate<double>(scene, state, posed_, volumes.volume, near_, a.fields, given);
    a.tolerance = Fields::unwritten(state.size(), walls.size());
    for (auto* facts : {&a.tolerance.fluid_neighbor_count, &a.tolerance.fluid_neighbor_id_sum,
                        &a.tolerance.wall_neighbor_count, &a.tolerance.wall_neighbor_id_sum})
      facts->setZero();
    a.tolerance.boundary_volume = volumes.tolerance;
    ambiguous_pairs();
    density_and_pressure();
    wall_velocity_error(walls);
    accelerations();
  }

  OracleAnswer take() { return std::move(answer_); }

 private:
  /// Extra magnitude that a pair across a periodic boundary passes through, m.
  double image_magnitude(const Vec3& x_i, const Vec3& x_j, const Vec3& x_ij) const {
    return (x_i - x_j - x_ij).cwiseAbs().maxCoeff();
  }

  void density_and_pressure() {
    const double m = scene_.particle_mass(), rho0 = scene_.fluid.rest_density;
    const double gamma = scene_.fluid.eos_exponent, B = scene_.eos_stiffness();
    const double c0 = scene_.fluid.sound_speed;
    const auto n = state_.size();
    const auto& V = answer_.fields.boundary_volume;
    auto& C = answer_.condition;
    C.density.setZero(n);
    C.density_pose.setZero(n);
    tau_q_.setZero(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Vec3 x_i = state_.position.col(i);
      const auto& fluid = near_.fluid[static_cast<std::size_t>(i)];
      const auto& wall = near_.wall[static_cast<std::size_t>(i)];
      double sum = m * kernel_.W(0), pose = 0, from_volumes = 0;
      for (const auto j : fluid) {
        const Vec3 x_j = state_.position.col(j), x_ij = separation_(x_i, x_j);
        const double r = x_ij.norm(), slope = kernel_.slope_W(r);
        sum += m * (kernel_.W(r) + r * slope);
        pose += m * slope * image_magnitude(x_i, x_j, x_ij);
      }
      for (const auto b : wall) {
        const Vec3 x_b = posed_.position.col(b), x_ib = separation_(x_i, x_b);
        const double r = x_ib.norm(), W = kernel_.W(r), slope = kernel_.slope_W(r);
        sum += rho0 * V[b] * (W + r * slope);
        pose += rho0 * V[b] * slope * std::max(X_[b], image_magnitude(x_i, x_b, x_ib));
        from_volumes += rho0 * answer_.tolerance.boundary_volume[b] * W;
      }
      // A pair that fp32 may place inside H has a term no larger than that of its nearest place.
      double from_edge = 0;
      for (const Edge& e : edge_fluid_[static_cast<std::size_t>(i)]) from_edge += m * kernel_.W(e.r);
      for (const Edge& e : edge_wall_[static_cast<std::size_t>(i)])
        from_edge += rho0 * V[e.id] * kernel_.W(e.r);
      C.density[i] = sum;
      C.density_pose[i] = pose;
      answer_.tolerance.density[i] =
          growth(fluid.size() + wall.size() + 1, 6) * (sum + pose) + from_volumes + from_edge;

      // Pressure follows from the backend's own density unless density is given.
      const bool rho_given = given_ && given_->density.size();
      const double rho = rho_given ? given_->density[i] : answer_.fields.density[i];
      const double tau_rho = rho_given ? 0.0 : answer_.tolerance.density[i];
      const double compression = rho / rho0;
      const double unclamped = B * (std::pow(compression, gamma) - 1);
      double tau_p = c0 * c0 * std::pow(compression, gamma - 1) * tau_rho +
                     20 * u * B * std::pow(compression, gamma) + 3 * u * std::max(-unclamped, 0.0);
      if (!scene_.fluid.allow_tension && unclamped + tau_p < 0) tau_p = 0;
      answer_.tolerance.pressure[i] = tau_p;
      const bool p_given = given_ && given_->pressure.size();
      const double p = p_given ? given_->pressure[i] : answer_.fields.pressure[i];
      if (p_given) tau_p = 0;
      tau_q_[i] = tau_p / (rho * rho) + 2 * std::abs(p) * tau_rho / (rho * rho * rho) +
                  3 * u * std::abs(p) / (rho * rho);
    }
  }

  /// Rounding of v_b = omega × (x_b − pivot) + v_pivot + v_surface, by wall particle, m/s.
  void wall_velocity_error(const Walls& walls) {
    wall_velocity_error_.resize(walls.size());
    Eigen::Index b = 0;
    for (std::size_t c = 0; c < walls.containers.size(); ++c) {
      const Pose pose = pose_at(scene_.containers[c], scene_.time_at(state_.substep));
      for (Eigen::Index k = 0; k < walls.containers[c].position.cols(); ++k, ++b)
        wall_velocity_error_[b] =
            pose.angular_velocity.norm() * (X_[b] + pose.pivot.cwiseAbs().maxCoeff()) +
            pose.linear_velocity.norm() + pose.surface_velocity.norm();
    }
  }

  void accelerations() {
    const auto n = state_.size();
    auto& C = answer_.condition;
    auto& T = answer_.tolerance;
    for (auto* sum : {&C.pressure_acceleration, &C.viscous_acceleration,
                      &C.wall_pressure_acceleration, &C.wall_viscous_acceleration})
      sum->setZero(3, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto& fluid = near_.fluid[static_cast<std::size_t>(i)];
      const auto& wall = near_.wall[static_cast<std::size_t>(i)];
      ForceBounds pressure, viscous, wall_pressure, wall_viscous;
      fluid_bounds(i, fluid, pressure, viscous);
      wall_bounds(i, wall, wall_pressure, wall_viscous);
      C.pressure_acceleration.col(i) = pressure.condition;
      C.viscous_acceleration.col(i) = viscous.condition;
      C.wall_pressure_acceleration.col(i) = wall_pressure.condition;
      C.wall_viscous_acceleration.col(i) = wall_viscous.condition;
      const double by_fluid = growth(fluid.size() + 1, 8), by_wall = growth(wall.size() + 1, 8);
      T.pressure_acceleration.col(i) = pressure.tolerance(by_fluid, tau_q_[i]);
      T.viscous_acceleration.col(i) = viscous.tolerance(by_fluid, 0);
      T.wall_pressure_acceleration.col(i) = wall_pressure.tolerance(by_wall, tau_q_[i]);
      T.wall_viscous_acceleration.col(i) = wall_viscous.tolerance(by_wall, 0);
      ForceBounds all = pressure;
      ((all += viscous) += wall_pressure) += wall_viscous;
      T.acceleration.col(i) =
          all.tolerance(growth(fluid.size() + wall.size() + 1, 8), tau_q_[i]) +
          3 * u * (scene_.gravity.cwiseAbs() + answer_.fields.acceleration.col(i).cwiseAbs());
    }
  }

  double density_of(Eigen::Index i) const {
    return given_ && given_->density.size() ? given_->density[i] : answer_.fields.density[i];
  }
  double relative_density_error(Eigen::Index i) const {
    return given_ && given_->density.size()
               ? 0.0
               : answer_.tolerance.density[i] / answer_.fields.density[i];
  }
  double q_of(Eigen::Index i) const {
    const double p =
        given_ && given_->pressure.size() ? given_->pressure[i] : answer_.fields.pressure[i];
    return p / (density_of(i) * density_of(i));
  }

  void fluid_bounds(Eigen::Index i, const std::vector<std::int32_t>& ids, ForceBounds& pressure,
                    ForceBounds& viscous) const {
    const double m = scene_.particle_mass(), mu = scene_.fluid.viscosity;
    const Vec3 x_i = state_.position.col(i), v_i = state_.velocity.col(i);
    for (const auto j : ids) {
      const Vec3 x_j = state_.position.col(j), x_ij = separation_(x_i, x_j);
      const double r = x_ij.norm(), G = kernel_.G(r), dG = kernel_.slope_G(r);
      const Vec3 x = x_ij.cwiseAbs();
      const double A = m * std::abs(q_of(i) + q_of(j)), image = image_magnitude(x_i, x_j, x_ij);
      pressure.condition += A * (G + r * dG) * x;
      pressure.pose += A * image * (Vec3::Constant(G) + std::sqrt(3.0) * dG * x);
      pressure.squares += (m * tau_q_[j] * G * x).cwiseAbs2();
      pressure.gradient += m * G * x_ij;
      const Vec3 dv = (state_.velocity.col(j) - v_i).cwiseAbs();
      const double D = mu / density_of(i) * m / density_of(j);
      const double L = kernel_.L(r), dL = kernel_.slope_L(r);
      viscous.condition += D * (L + r * dL) * dv;
      viscous.pose += D * dL * std::sqrt(3.0) * image * dv;
      viscous.inputs += D * L * (relative_density_error(i) + relative_density_error(j)) * dv;
    }
    for (const Edge& e : edge_fluid_[static_cast<std::size_t>(i)]) {
      const Eigen::Index j = e.id;
      pressure.inputs += m * std::abs(q_of(i) + q_of(j)) * kernel_.G(e.r) *
                         separation_(x_i, Vec3(state_.position.col(j))).cwiseAbs();
      viscous.inputs += mu / density_of(i) * m / density_of(j) * kernel_.L(e.r) *
                        (state_.velocity.col(j) - v_i).cwiseAbs();
    }
  }

  void wall_bounds(Eigen::Index i, const std::vector<std::int32_t>& ids, ForceBounds& pressure,
                   ForceBounds& viscous) const {
    const double rho0 = scene_.fluid.rest_density, mu_w = scene_.fluid.wall_viscosity;
    const auto& V = answer_.fields.boundary_volume;
    const Vec3 x_i = state_.position.col(i), v_i = state_.velocity.col(i);
    for (const auto b : ids) {
      const Vec3 x_b = posed_.position.col(b), x_ib = separation_(x_i, x_b);
      const double r = x_ib.norm(), G = kernel_.G(r), dG = kernel_.slope_G(r);
      const Vec3 x = x_ib.cwiseAbs();
      const double X = std::max(X_[b], image_magnitude(x_i, x_b, x_ib));
      const double tau_V = answer_.tolerance.boundary_volume[b];
      const double A = rho0 * V[b] * std::abs(q_of(i));
      pressure.condition += A * (G + r * dG) * x;
      pressure.pose += A * X * (Vec3::Constant(G) + std::sqrt(3.0) * dG * x);
      pressure.inputs += A / V[b] * tau_V * G * x;
      pressure.gradient += rho0 * V[b] * G * x_ib;
      const Vec3 dv = (posed_.velocity.col(b) - v_i).cwiseAbs();
      const double D = mu_w / density_of(i) * V[b], L = kernel_.L(r), dL = kernel_.slope_L(r);
      viscous.condition += D * (L + r * dL) * dv;
      viscous.pose += D * (dL * std::sqrt(3.0) * X * dv + Vec3::Constant(L * wall_velocity_error_[b]));
      viscous.inputs += D * L * (relative_density_error(i) + tau_V / V[b]) * dv;
    }
    for (const Edge& e : edge_wall_[static_cast<std::size_t>(i)]) {
      pressure.inputs += rho0 * V[e.id] * std::abs(q_of(i)) * kernel_.G(e.r) *
                         separation_(x_i, Vec3(posed_.position.col(e.id))).cwiseAbs();
      viscous.inputs += mu_w / density_of(i) * V[e.id] * kernel_.L(e.r) *
                        (posed_.velocity.col(e.id) - v_i).cwiseAbs();
    }
  }

  /// Whether every r² up to H² is exact in fp32: coordinates and H are whole multiples of some power of
  /// two, 2^-11 of H at least. Then nothing about fluid neighbors is ambiguous, r = H included.
  bool exact_distances() const {
    const double H = scene_.support_radius(), grid = std::exp2(std::floor(std::log2(H)) - 10);
    const auto whole = [&](double x) { return std::remainder(x, grid) == 0; };
    const auto& x = state_.position;
    return whole(H) && !(scene_.domain.periodic[0] || scene_.domain.periodic[1] ||
                         scene_.domain.periodic[2]) &&
           std::all_of(x.data(), x.data() + x.size(), whole);
  }

  /// Pairs within 8 u X of H, X the largest magnitude the distance passes through; those beyond H have no
  /// term in the oracle's sums, but may have one in fp32.
  void ambiguous_pairs() {
    const double H = scene_.support_radius();
    const double widest = std::max({H, X_.size() ? X_.maxCoeff() : 0.0,
                                    (scene_.domain.max - scene_.domain.min).maxCoeff()});
    Scene wider = scene_;
    wider.support_ratio = (H + 8 * u * widest) / scene_.particle_spacing;
    Neighbors near;
    find_neighbors(wider, state_.position, posed_.position, NeighborSearch::cells, near);
    const auto n = static_cast<std::size_t>(state_.size());
    edge_fluid_.resize(n);
    edge_wall_.resize(n);
    answer_.fluid_ambiguous.assign(n, false);
    answer_.wall_ambiguous.assign(n, false);
    // A shell of half-width d about H holds 6 d/H of the pairs inside H where the fluid is uniform.
    double expected_fluid = 0, expected_wall = 0;
    const bool exact = exact_distances();
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 x_i = state_.position.col(static_cast<Eigen::Index>(i));
      for (const auto j : near.fluid[i]) {
        const Vec3 x_j = state_.position.col(j), x_ij = separation_(x_i, x_j);
        const double margin = 8 * u * std::max(H, image_magnitude(x_i, x_j, x_ij));
        const double r = x_ij.norm();
        if (!exact && std::abs(r - H) <= margin) {
          answer_.fluid_ambiguous[i] = true;
          if (r >= H) edge_fluid_[i].push_back({j, H - margin});
        }
        expected_fluid += 6 * margin / H;
      }
      for (const auto b : near.wall[i]) {
        const Vec3 x_b = posed_.position.col(b), x_ib = separation_(x_i, x_b);
        const double margin = 8 * u * std::max({H, X_[b], image_magnitude(x_i, x_b, x_ib)});
        const double r = x_ib.norm();
        if (std::abs(r - H) <= margin) {
          answer_.wall_ambiguous[i] = true;
          if (r >= H) edge_wall_[i].push_back({b, H - margin});
        }
        expected_wall += 6 * margin / H;
      }
    }
    answer_.most_fluid_ambiguous = static_cast<std::int64_t>(std::ceil(4 * expected_fluid)) + 10;
    answer_.most_wall_ambiguous = static_cast<std::int64_t>(std::ceil(4 * expected_wall)) + 10;
  }

  const Scene& scene_;
  const ParticleState& state_;
  const StageInputs* given_;
  Kernel<double> kernel_;
  Separation separation_;
  PosedWalls posed_;
  Eigen::VectorXd X_, tau_q_, wall_velocity_error_;
  Neighbors near_;
  /// A pair at H or just beyond, and the least distance that fp32 may find.
  struct Edge {
    std::int32_t id;
    double r;
  };
  std::vector<std::vector<Edge>> edge_fluid_, edge_wall_;
  OracleAnswer answer_;
};

}  // namespace

WallAnswer wall_answer(const Scene& scene, const Walls& walls) {
  const WallNeighbors neighbors = find_wall_neighbors(scene, walls);
  WallAnswer a;
  a.volume = boundary_volumes<double>(scene, neighbors);
  a.tolerance = volume_tolerances(scene, neighbors, a.volume);
  a.float_volume = boundary_volumes<float>(scene, neighbors);
  return a;
}

OracleAnswer answer(const Scene& scene, const Walls& walls, const WallAnswer& volumes,
                    const ParticleState& state, const StageInputs* given) {
  return Bounds(scene, walls, volumes, state, given).take();
}

OracleAnswer answer(const Scene& scene, const Walls& walls, const ParticleState& state) {
  return answer(scene, walls, wall_answer(scene, walls), state);
}

Fields float_fields(const Scene& scene, const Walls& walls, const WallAnswer& volumes,
                    const ParticleState& state, const StageInputs* given) {
  const PosedWalls posed = pose_walls(scene, walls, scene.time_at(state.substep));
  Neighbors near;
  find_neighbors(scene, state.position, posed.position, NeighborSearch::cells, near);
  Fields fields;
  evaluate<float>(scene, state, posed, volumes.float_volume, near, fields, given);
  return fields;
}

}  // namespace decant
