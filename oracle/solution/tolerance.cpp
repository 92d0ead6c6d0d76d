/// \file
/// One pass for density and pressure, one for accelerations, each beside the oracle's own; the passes mirror the
/// formulas in tolerance.hpp.
#include "oracle/solution/tolerance.hpp"

#include "oracle/solution/force_bounds.hpp"
#include "oracle/solution/pose_error.hpp"
#include "oracle/solution/sum_bound.hpp"
#include "reference/kernel.hpp"
#include "reference/pair_terms.hpp"
#include "reference/pose.hpp"
#include "reference/solver.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

constexpr double u = both_roundoffs;

}  // namespace

class ReferenceAt::Bounds {
 public:
  Bounds(const Scene& scene, const Walls& walls, const WallSolution& volumes, const ParticleState& state)
      : scene_(scene),
        volumes_(volumes),
        state_(state),
        H_(scene.support_radius()),
        periodic_(scene.domain.periodic[0] || scene.domain.periodic[1] || scene.domain.periodic[2]),
        kernel_(scene.kernel, H_),
        separation_(scene.domain),
        posed_(pose_walls(scene, walls, scene.time_at(state.substep))),
        pose_(pose_errors(scene, walls, posed_, scene.time_at(state.substep), u)),
        common_(scene.kernel) {
    Neighbors near_H;
    find_neighbors_and_shell(scene, state.position, posed_.position, widest_margin(), near_, near_H);
    ambiguous_pairs(near_H);
  }

  ReferenceSolution solution(const StageInputs* given) {
    given_ = given;
    ReferenceSolution& a = solution_ = {};
    evaluate<double>(scene_, state_, posed_, volumes_.volume, near_, a.fields, given);
    const auto n = static_cast<std::size_t>(state_.size());
    a.tolerance = Fields::unwritten(state_.size(), volumes_.volume.size());
    for (auto* facts : {&a.tolerance.fluid_neighbor_count, &a.tolerance.fluid_neighbor_id_sum,
                        &a.tolerance.wall_neighbor_count, &a.tolerance.wall_neighbor_id_sum})
      facts->setZero();
    a.tolerance.boundary_volume = volumes_.tolerance;
    a.fluid_ambiguous.resize(n);
    a.wall_ambiguous.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      a.fluid_ambiguous[i] = !edge_fluid_[i].empty();
      a.wall_ambiguous[i] = !edge_wall_[i].empty();
    }
    density_and_pressure();
    accelerations();
    return std::move(solution_);
  }

  Fields fp32_fields(const StageInputs* given) const {
    Fields fields;
    evaluate<float>(scene_, state_, posed_, volumes_.fp32_volume, near_, fields, given);
    return fields;
  }

 private:
  /// What the bounds of one particle are put together in; memory is kept from one to the next.
  struct Scratch {
    SumBound terms;
    CellCounter cells;
    ForceBounds pressure, viscous, wall_pressure, wall_viscous;
  };
  /// one(i, scratch) for all particles, on all cores: a particle's bounds are its own, and so are the bits that
  /// they come out with, whatever the number of threads.
  template <class One>
  static void for_particles(Eigen::Index n, One one) {
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, n, 256), [&](const auto& range) {
      Scratch scratch;
      for (Eigen::Index i = range.begin(); i < range.end(); ++i) one(i, scratch);
    });
  }

  /// By axis, of images with x_ij > 0 and with x_ij < 0.
  using Sides = Eigen::Matrix<double, 3, 2>;
  /// \param straight  x_i − x_j; \param x_ij  by the nearest image, m; \param per_length  Σ's term by |x_ij|
  static void add_images(const Vec3& straight, const Vec3& x_ij, const Vec3& per_length, Sides& to) {
    for (int a = 0; a < 3; ++a)
      if (straight[a] != x_ij[a]) to(a, x_ij[a] > 0 ? 0 : 1) += std::abs(x_ij[a]) * per_length[a];
  }
  /// Extra magnitude that a pair across a periodic boundary passes through, m.
  double image_magnitude(const Vec3& x_i, const Vec3& x_j, const Vec3& x_ij) const {
    return (x_i - x_j - x_ij).cwiseAbs().maxCoeff();
  }

  void density_and_pressure() {
    const double m = scene_.particle_mass(), rho0 = scene_.fluid.rest_density;
    const double own = of_density_term + of_mass + common_.W;
    const double own_of_wall = of_density_term + of_wall_factors + common_.W;
    const auto n = state_.size();
    const auto& V = solution_.fields.boundary_volume;
    auto& C = solution_.condition;
    C.density.setZero(n);
    C.density_pose.setZero(n);
    tau_q_.setZero(n);
    in_common_q_.setZero(periodic_ ? 11 : 5, n);
    // A shell of half-width d about H holds 6 d/H of the pairs inside H where the fluid is uniform.
    Eigen::VectorXd ambiguous_fluid = Eigen::VectorXd::Zero(n), ambiguous_wall = Eigen::VectorXd::Zero(n);
    for_particles(n, [&](Eigen::Index i, Scratch& scratch) {
      SumBound& terms = scratch.terms;
      const Vec3 x_i = state_.position.col(i);
      const auto& fluid = near_.fluid[static_cast<std::size_t>(i)];
      const auto& wall = near_.wall[static_cast<std::size_t>(i)];
      terms.clear();
      const double self = m * kernel_.W(0);
      terms.add(self);
      double sum = self, inside = own * self, by_H = -3 * self, pose = 0, misplaced = 0, from_volumes = 0;
      Vec3 displaced = Vec3::Zero();  // what the walls being off alike along each axis adds, kg/m³
      Sides images = Sides::Zero();   // and the images on each side
      for (const auto j : fluid) {
        const Vec3 x_j = state_.position.col(j), x_ij = separation_(x_i, x_j);
        const double r = x_ij.norm(), t = m * kernel_.W(r), slope = m * kernel_.slope_W(r);
        terms.add(t);
        sum += t + r * slope;
        inside += own * t + of_distance * r * slope;
        by_H += r * slope - 3 * t;
        pose += slope * image_magnitude(x_i, x_j, x_ij);
        const Vec3 e = pair_error(x_i, x_j, x_ij, scene_.domain, H_, u);
        misplaced += slope * error_along(x_ij, r, e);
        if (periodic_ && r > 0) add_images(x_i - x_j, x_ij, slope / r * e, images);
        ambiguous_fluid[i] += 6 * margin(e) / H_;
      }
      for (const auto b : wall) {
        const Vec3 x_b = posed_.position.col(b), x_ib = separation_(x_i, x_b);
        const double r = x_ib.norm(), W = kernel_.W(r);
        const double t = rho0 * V[b] * W, slope = rho0 * V[b] * kernel_.slope_W(r);
        terms.add(t);
        sum += t + r * slope;
        inside += own_of_wall * t + of_distance * r * slope;
        by_H += r * slope - 3 * t;
        pose += slope * std::max(pose_.largest[b], image_magnitude(x_i, x_b, x_ib));
        const Vec3 e = wall_error(b, x_i, x_b, x_ib);
        misplaced += slope * error_along(x_ib, r, e);
        ambiguous_wall[i] += 6 * margin(e) / H_;
        if (r > 0) displaced += slope / r * x_ib.cwiseProduct(e);
        if (periodic_ && r > 0) add_images(x_i - x_b, x_ib, slope / r * e, images);
        from_volumes += rho0 * solution_.tolerance.boundary_volume[b] * W;
      }
      // A pair that fp32 may place inside H has a term no larger than that of its nearest place.
      double from_edge = 0;
      for (const Edge& e : edge_fluid_[static_cast<std::size_t>(i)]) from_edge += m * kernel_.W(e.r);
      for (const Edge& e : edge_wall_[static_cast<std::size_t>(i)]) from_edge += rho0 * V[e.id] * kernel_.W(e.r);
      C.density[i] = sum;
      C.density_pose[i] = pose;
      solution_.tolerance.density[i] =
          terms.error(u, u * (inside + std::abs(by_H)), scratch.cells) + misplaced + from_volumes + from_edge;
      pressure_bounds(i, displaced, from_volumes, images);
    });
    solution_.most_fluid_ambiguous = static_cast<std::int64_t>(std::ceil(4 * ambiguous_fluid.sum())) + 10;
    solution_.most_wall_ambiguous = static_cast<std::int64_t>(std::ceil(4 * ambiguous_wall.sum())) + 10;
  }

  /// Pressure follows from the backend's own density unless density is given.
  /// \param displaced  what density changes by where walls are off alike along each axis; \param from_volumes
  /// where their volumes are too large alike; \param images  where images are off alike, by axis and side, kg/m³
  void pressure_bounds(Eigen::Index i, const Vec3& displaced, double from_volumes, const Sides& images) {
    const FluidProperties& fluid = scene_.fluid;
    const double gamma = fluid.eos_exponent, B = scene_.eos_stiffness(), c0 = fluid.sound_speed;
    const double rho0 = fluid.rest_density;
    const bool rho_given = given_ && given_->density.size();
    const double rho = rho_given ? given_->density[i] : solution_.fields.density[i];
    const double tau_rho = rho_given ? 0.0 : solution_.tolerance.density[i];
    const double compression = rho / rho0, power = std::pow(compression, gamma);
    const double unclamped = B * (power - 1);
    const double off_rho0 = static_cast<double>(static_cast<float>(rho0)) == rho0 ? 0 : 1;
    double tau_p = c0 * c0 * std::pow(compression, gamma - 1) * tau_rho +
                   u * ((gamma * (2 + off_rho0) + 6) * B * power + 6 * std::abs(unclamped));
    if (!fluid.allow_tension && unclamped + tau_p < 0) tau_p = 0;
    solution_.tolerance.pressure[i] = tau_p;
    const bool p_given = given_ && given_->pressure.size();
    const double p = p_given ? given_->pressure[i] : solution_.fields.pressure[i];
    if (p_given) tau_p = 0;
    tau_q_[i] = tau_p / (rho * rho) + 2 * std::abs(p) * tau_rho / (rho * rho * rho) + 4 * u * std::abs(p) / (rho * rho);
    if (tau_p == 0 || rho_given) return;
    // What is off alike for all particles shifts their q together: norm and mass, the walls' place (a rounded
    // translation or pivot), their volumes, images by a rounded period.
    const double slope = c0 * c0 * std::pow(compression, gamma - 1) / (rho * rho) - 2 * p / (rho * rho * rho);
    in_common_q_.col(i).head<5>() << u * (common_.W + of_mass) * rho * slope, slope * displaced, slope * from_volumes;
    if (periodic_) in_common_q_.col(i).tail<6>() = slope * images.reshaped();
  }

  /// Error of x_i − x_b, by component, m.
  Vec3 wall_error(Eigen::Index b, const Vec3& x_i, const Vec3& x_b, const Vec3& x_ib) const {
    return pose_.position.col(b) + pair_error(x_i, x_b, x_ib, scene_.domain, H_, u);
  }

  void accelerations() {
    const auto n = state_.size();
    auto& C = solution_.condition;
    auto& T = solution_.tolerance;
    for (auto* sum : {&C.pressure_acceleration, &C.viscous_acceleration, &C.wall_pressure_acceleration,
                      &C.wall_viscous_acceleration})
      sum->setZero(3, n);
    rho_ = given_ && given_->density.size() ? given_->density : solution_.fields.density;
    q_ = (given_ && given_->pressure.size() ? given_->pressure : solution_.fields.pressure).array() /
         rho_.array().square();
    rho_off_.setZero(n);
    if (!(given_ && given_->density.size()))
      rho_off_ = solution_.tolerance.density.array() / solution_.fields.density.array();
    for_particles(n, [&](Eigen::Index i, Scratch& scratch) {
      auto& [terms, cells, pressure, viscous, wall_pressure, wall_viscous] = scratch;
      for (ForceBounds* part : {&pressure, &viscous, &wall_pressure, &wall_viscous}) part->clear();
      fluid_bounds(i, near_.fluid[static_cast<std::size_t>(i)], pressure, viscous);
      wall_bounds(i, near_.wall[static_cast<std::size_t>(i)], wall_pressure, wall_viscous);
      const double in_common = common_.G + 5;  // 5: G and L go with H⁻⁵
      pressure.close(in_common + of_mass);
      viscous.close(in_common + of_mass);
      wall_pressure.close(in_common);
      wall_viscous.close(in_common);
      C.pressure_acceleration.col(i) = pressure.condition;
      C.viscous_acceleration.col(i) = viscous.condition;
      C.wall_pressure_acceleration.col(i) = wall_pressure.condition;
      C.wall_viscous_acceleration.col(i) = wall_viscous.condition;
      T.pressure_acceleration.col(i) = pressure.tolerance(tau_q_[i], cells);
      T.viscous_acceleration.col(i) = viscous.tolerance(0, cells);
      T.wall_pressure_acceleration.col(i) = wall_pressure.tolerance(tau_q_[i], cells);
      T.wall_viscous_acceleration.col(i) = wall_viscous.tolerance(0, cells);
      // Gravity is a term like any other: a register may start from it.
      ((pressure += viscous) += wall_pressure) += wall_viscous;
      pressure.add(scene_.gravity);
      pressure.inside += scene_.gravity.cwiseAbs();
      T.acceleration.col(i) = pressure.tolerance(tau_q_[i], cells);
    });
  }

  /// Factors of G or L, whose norm a port may multiply first or last.
  double least_of(double kernel_value) const {
    return least(kernel_.norm_G()) * least(kernel_value / kernel_.norm_G());
  }

  void fluid_bounds(Eigen::Index i, const std::vector<std::int32_t>& ids, ForceBounds& pressure,
                    ForceBounds& viscous) const {
    const double m = scene_.particle_mass(), mu = scene_.fluid.viscosity;
    const double own = of_pressure_term, own_viscous = of_viscous_term;
    const Vec3 x_i = state_.position.col(i), v_i = state_.velocity.col(i);
    const double q_i = q_[i], of_i = mu / rho_[i] * m;
    Eigen::Matrix<double, 3, 5> in_common = Eigen::Matrix<double, 3, 5>::Zero();
    Eigen::Matrix<double, 3, 6> by_images = Eigen::Matrix<double, 3, 6>::Zero();
    for (const auto j : ids) {
      const Vec3 x_j = state_.position.col(j), x_ij = separation_(x_i, x_j);
      const double r = x_ij.norm(), G = kernel_.G(r), dG = kernel_.slope_G(r);
      const Vec3 x = x_ij.cwiseAbs();
      const double q_j = q_[j], A = m * (std::abs(q_i) + std::abs(q_j));
      const Vec3 e = pair_error(x_i, x_j, x_ij, scene_.domain, H_, u);
      const double e_r = error_along(x_ij, r, e);
      pressure.add(m * (q_i + q_j) * G * x_ij);
      pressure.condition += m * std::abs(q_i + q_j) * (G + r * dG) * x;
      pressure.inside += A * (own * G + of_distance_and_H * r * dG) * x;
      pressure.pose += A * (G * e + dG * e_r * x);
      pressure.squares += (m * tau_q_[j] * G * x).cwiseAbs2();
      pressure.gradient += m * G * x_ij;
      pressure.underflow(m * (q_i + q_j) * G * x_ij, least(m) * least(A / m) * least_of(G), x_ij, A * G);
      in_common += m * G * x_ij * (in_common_q_.col(i).head<5>() + in_common_q_.col(j).head<5>()).transpose();
      if (periodic_)
        by_images += m * G * x_ij * (in_common_q_.col(i).tail<6>() + in_common_q_.col(j).tail<6>()).transpose();
      const Vec3 v_ji = state_.velocity.col(j) - v_i, dv = v_ji.cwiseAbs();
      const double D = of_i / rho_[j];
      const double L = kernel_.L(r), dL = kernel_.slope_L(r);
      viscous.add(D * L * v_ji);
      viscous.condition += D * (L + r * dL) * dv;
      viscous.inside += D * (own_viscous * L + of_distance_and_H * r * dL) * dv;
      viscous.pose += D * dL * e_r * dv;
      viscous.inputs += D * L * (rho_off_[i] + rho_off_[j]) * dv;
      viscous.underflow(D * L * v_ji, least(mu) * least(m) * least(1 / rho_[i]) * least(1 / rho_[j]) * least_of(L),
                        v_ji, D * L);
    }
    pressure.inputs += in_common.cwiseAbs().rowwise().sum() + by_images.cwiseAbs().rowwise().sum();
    for (const Edge& e : edge_fluid_[static_cast<std::size_t>(i)]) {
      const Eigen::Index j = e.id;
      pressure.inputs +=
          m * std::abs(q_i + q_[j]) * kernel_.G(e.r) * separation_(x_i, Vec3(state_.position.col(j))).cwiseAbs();
      viscous.inputs += of_i / rho_[j] * kernel_.L(e.r) * (state_.velocity.col(j) - v_i).cwiseAbs();
    }
  }

  void wall_bounds(Eigen::Index i, const std::vector<std::int32_t>& ids, ForceBounds& pressure,
                   ForceBounds& viscous) const {
    const double rho0 = scene_.fluid.rest_density, mu_w = scene_.fluid.wall_viscosity;
    const double own = of_pressure_term + of_wall_factors;
    const double own_viscous = of_viscous_term + of_wall_factors;
    const auto& V = solution_.fields.boundary_volume;
    const Vec3 x_i = state_.position.col(i), v_i = state_.velocity.col(i);
    for (const auto b : ids) {
      const Vec3 x_b = posed_.position.col(b), x_ib = separation_(x_i, x_b);
      const double r = x_ib.norm(), G = kernel_.G(r), dG = kernel_.slope_G(r);
      const Vec3 x = x_ib.cwiseAbs();
      const Vec3 e = wall_error(b, x_i, x_b, x_ib);
      const double e_r = error_along(x_ib, r, e);
      const double tau_V = solution_.tolerance.boundary_volume[b];
      const double A = rho0 * V[b] * std::abs(q_[i]);
      pressure.add(rho0 * V[b] * q_[i] * G * x_ib);
      pressure.condition += A * (G + r * dG) * x;
      pressure.inside += A * (own * G + of_distance_and_H * r * dG) * x;
      pressure.pose += A * (G * e + dG * e_r * x);
      pressure.inputs += A / V[b] * tau_V * G * x;
      pressure.gradient += rho0 * V[b] * G * x_ib;
      pressure.underflow(rho0 * V[b] * q_[i] * G * x_ib,
                         least(rho0) * least(V[b]) * least(std::abs(q_[i])) * least_of(G), x_ib, A * G);
      const Vec3 v_bi = posed_.velocity.col(b) - v_i, dv = v_bi.cwiseAbs();
      const double D = mu_w / rho_[i] * V[b], L = kernel_.L(r), dL = kernel_.slope_L(r);
      viscous.add(D * L * v_bi);
      viscous.condition += D * (L + r * dL) * dv;
      viscous.inside += D * (own_viscous * L + of_distance_and_H * r * dL) * dv;
      viscous.pose += D * (dL * e_r * dv + L * pose_.velocity.col(b));
      viscous.inputs += D * L * (rho_off_[i] + tau_V / V[b]) * dv;
      viscous.underflow(D * L * v_bi, least(mu_w) * least(1 / rho_[i]) * least(V[b]) * least_of(L), v_bi, D * L);
    }
    for (const Edge& e : edge_wall_[static_cast<std::size_t>(i)]) {
      pressure.inputs += rho0 * V[e.id] * std::abs(q_[i]) * kernel_.G(e.r) *
                         separation_(x_i, Vec3(posed_.position.col(e.id))).cwiseAbs();
      viscous.inputs += mu_w / rho_[i] * V[e.id] * kernel_.L(e.r) * (posed_.velocity.col(e.id) - v_i).cwiseAbs();
    }
  }

  /// Whether every r² up to H² is exact in fp32: coordinates and H are whole multiples of some power of
  /// two, 2^-11 of H at least. Then nothing about fluid neighbors is ambiguous, r = H included.
  bool exact_distances() const {
    const double H = scene_.support_radius(), grid = std::exp2(std::floor(std::log2(H)) - 10);
    const auto whole = [&](double x) { return std::remainder(x, grid) == 0; };
    const auto& x = state_.position;
    return whole(H) && !periodic_ && std::all_of(x.data(), x.data() + x.size(), whole);
  }

  /// What no pair's margin exceeds, m.
  double widest_margin() const {
    double widest = 12 * u * H_;
    if (pose_.position.size()) widest += pose_.position.colwise().norm().maxCoeff();
    const Domain& domain = scene_.domain;
    if (periodic_)
      widest +=
          9 * u *
          ((domain.max - domain.min).maxCoeff() + domain.min.cwiseAbs().cwiseMax(domain.max.cwiseAbs()).maxCoeff());
    return widest;
  }
  /// How far fp32's distance may be from the pair's, m. \param e  error of its separation
  double margin(const Vec3& e) const { return 8 * u * H_ + e.norm(); }

  /// Pairs whose distance fp32 may find on the other side of H: within 8 u H and what their places are
  /// off. Those beyond H have no term in the oracle's sums, but may have one in fp32; those inside may have
  /// none, or one that their own, near zero of an order above one, says nothing about.
  void ambiguous_pairs(const Neighbors& near_H) {
    const auto n = static_cast<std::size_t>(state_.size());
    edge_fluid_.resize(n);
    edge_wall_.resize(n);
    const bool exact = exact_distances();
    for_particles(state_.size(), [&](Eigen::Index particle, Scratch&) {
      const auto i = static_cast<std::size_t>(particle);
      const Vec3 x_i = state_.position.col(particle);
      for (const auto j : near_H.fluid[i]) {
        const Vec3 x_j = state_.position.col(j), x_ij = separation_(x_i, x_j);
        const double r = x_ij.norm(), off = margin(pair_error(x_i, x_j, x_ij, scene_.domain, H_, u));
        if (exact || std::abs(r - H_) > off) continue;
        edge_fluid_[i].push_back({j, std::min(r, H_) - off});
      }
      for (const auto b : near_H.wall[i]) {
        const Vec3 x_b = posed_.position.col(b), x_ib = separation_(x_i, x_b);
        const double r = x_ib.norm(), off = margin(wall_error(b, x_i, x_b, x_ib));
        if (std::abs(r - H_) > off) continue;
        edge_wall_[i].push_back({b, std::min(r, H_) - off});
      }
    });
  }

  const Scene& scene_;
  const WallSolution& volumes_;
  const ParticleState& state_;
  const StageInputs* given_ = nullptr;
  double H_;
  bool periodic_;
  Kernel<double> kernel_;
  Separation separation_;
  PosedWalls posed_;
  PoseErrors pose_;
  CommonRoundings common_;
  Eigen::VectorXd rho_, rho_off_, q_, tau_q_;  // rho_off: tau_rho / rho
  Eigen::MatrixXd in_common_q_;  // how far all q shift together, by cause, the last six on periodic axes alone
  Neighbors near_;
  /// A pair near H, and the least distance that fp32 may find.
  struct Edge {
    std::int32_t id;
    double r;
  };
  std::vector<std::vector<Edge>> edge_fluid_, edge_wall_;
  ReferenceSolution solution_;
};

ReferenceAt::ReferenceAt(const Scene& scene, const Walls& walls, const WallSolution& volumes,
                         const ParticleState& state)
    : bounds_(std::make_unique<Bounds>(scene, walls, volumes, state)) {}
ReferenceAt::~ReferenceAt() = default;
ReferenceSolution ReferenceAt::solution(const StageInputs* given) { return bounds_->solution(given); }
Fields ReferenceAt::fp32_fields(const StageInputs* given) const { return bounds_->fp32_fields(given); }

ReferenceSolution reference_solution(const Scene& scene, const Walls& walls, const WallSolution& volumes,
                                     const ParticleState& state, const StageInputs* given) {
  return ReferenceAt(scene, walls, volumes, state).solution(given);
}

ReferenceSolution reference_solution(const Scene& scene, const Walls& walls, const ParticleState& state) {
  return reference_solution(scene, walls, wall_solution(scene, walls), state);
}

}  // namespace decant
