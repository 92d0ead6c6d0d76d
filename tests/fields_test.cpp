/// \file
/// The fields of a small cloud beside a moving wall against a double loop over all pairs, written
/// from the formulas alone.
#include "reference/solver.hpp"
#include "tests/generators.hpp"
#include "tests/plain_kernel.hpp"

#include <gtest/gtest.h>

namespace decant::test {
namespace {

/// A cloud, and two containers' wall particles at random.
struct Case {
  Scene scene;
  Walls walls;
  ParticleState state;

  PosedWalls posed() const { return pose_walls(scene, walls, scene.time_at(state.substep)); }
};

/// \param size  edge of the cloud over H; \param per_wall  particles of each container; \param
/// tilts  the first one
Case random_case(KernelFamily family, int seed, int particles, double size, int per_wall, bool tilts = true) {
  Case c;
  c.scene = open_scene(family);
  c.scene.gravity = Vec3(0.3, -0.2, -9.81);
  const double edge = size * c.scene.support_radius();
  const Tilt tilt{Vec3(0.1, 0, 0.2), Vec3::UnitY(), {{0, 0}, {1, 1.5}}};
  c.scene.containers = {{"tilting", {}, Vec3::Zero(), 0.04, tilt}, {"fixed", {}, Vec3(0, 0, -0.2), 0.04, {}}};
  if (!tilts) c.scene.containers[0].tilt.reset();
  c.state = state_of(cloud(seed, particles, -edge / 2, edge / 2), cloud(seed + 1, particles, -2, 2));
  c.state.substep = 400;
  // Laid out where the poses put them beside the cloud.
  for (int k = 0; k < 2; ++k) {
    Eigen::Matrix3Xd x = cloud(seed + 2 + k, per_wall, -edge / 2, edge / 2);
    x.row(2).array() -= edge / 2;
    const Pose pose = pose_at(c.scene.containers[static_cast<std::size_t>(k)], c.scene.time_at(400));
    for (auto column : x.colwise()) column = pose.to_local(column);
    c.walls.containers.push_back({x});
  }
  return c;
}

/// What every field should be, and the sum of its terms' sizes, which its error is measured by.
struct Expected {
  Fields fields;
  Eigen::VectorXd pressure_size;
  Eigen::Matrix4Xd size;  // 4×N: fluid pressure, fluid viscous, wall pressure, wall viscous

  explicit Expected(const Case& c, const StageInputs& given = {});
};

Vec3 shortest(const Domain& domain, Vec3 gap) {
  for (int a = 0; a < 3; ++a)
    if (domain.periodic[a]) gap[a] = std::remainder(gap[a], domain.max[a] - domain.min[a]);
  return gap;
}

Expected::Expected(const Case& c, const StageInputs& given) {
  const Scene& s = c.scene;
  const double H = s.support_ratio * s.particle_spacing, rho0 = s.fluid.rest_density;
  const double m = s.mass_ratio * rho0 * std::pow(s.particle_spacing, 3), gamma = s.fluid.eos_exponent;
  const double B = rho0 * s.fluid.sound_speed * s.fluid.sound_speed / gamma;
  const PlainKernel kernel{s.kernel, H};
  const PosedWalls wall = c.posed();
  const Eigen::Matrix3Xd &x = c.state.position, &v = c.state.velocity;
  const Eigen::Index n = x.cols(), walls = wall.position.cols();
  const Eigen::Index first = c.walls.containers[0].position.cols();  // of the second container
  fields = Fields::unwritten(n, walls);
  size.setZero(4, n);
  for (Eigen::Index b = 0; b < walls; ++b) {
    double sum = 0;
    for (Eigen::Index k = 0; k < walls; ++k)
      if ((b < first) == (k < first))
        sum += kernel.W(shortest(s.domain, wall.position.col(b) - wall.position.col(k)).norm());
    fields.boundary_volume[b] = 1 / sum;
  }
  fields.density.setConstant(m * kernel.W(0));
  for (auto* list : {&fields.fluid_neighbor_count, &fields.fluid_neighbor_id_sum, &fields.wall_neighbor_count,
                     &fields.wall_neighbor_id_sum})
    list->setZero();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double r = shortest(s.domain, x.col(i) - x.col(j)).norm();
      if (i == j || r >= H) continue;
      fields.density[i] += m * kernel.W(r);
      fields.fluid_neighbor_count[i] += 1;
      fields.fluid_neighbor_id_sum[i] += j;
    }
    for (Eigen::Index b = 0; b < walls; ++b) {
      const double r = shortest(s.domain, x.col(i) - wall.position.col(b)).norm();
      if (r >= H) continue;
      fields.density[i] += rho0 * fields.boundary_volume[b] * kernel.W(r);
      fields.wall_neighbor_count[i] += 1;
      fields.wall_neighbor_id_sum[i] += b;
    }
  }
  const Eigen::VectorXd rho = given.density.size() ? given.density : fields.density;
  fields.pressure = B * ((rho / rho0).array().pow(gamma) - 1);
  if (!s.fluid.allow_tension) fields.pressure = fields.pressure.cwiseMax(0);
  pressure_size = B * ((rho / rho0).array().pow(gamma) + 1);
  const Eigen::VectorXd p = given.pressure.size() ? given.pressure : fields.pressure;
  const Eigen::ArrayXd q = p.array() / rho.array().square();
  const Eigen::ArrayXd q_size =
      given.pressure.size() ? q.abs().eval() : (pressure_size.array() / rho.array().square()).eval();
  for (auto* a : {&fields.pressure_acceleration, &fields.viscous_acceleration, &fields.wall_pressure_acceleration,
                  &fields.wall_viscous_acceleration})
    a->setZero();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const Vec3 x_ij = shortest(s.domain, x.col(i) - x.col(j));
      const double r = x_ij.norm();
      if (i == j || r >= H) continue;
      fields.pressure_acceleration.col(i) += m * (q[i] + q[j]) * kernel.G(r) * x_ij;
      size(0, i) += m * (q_size[i] + q_size[j]) * kernel.slope(r);
      const Vec3 drag = s.fluid.viscosity / rho[i] * m / rho[j] * (v.col(j) - v.col(i)) * kernel.L(r);
      fields.viscous_acceleration.col(i) += drag;
      size(1, i) += drag.norm();
    }
    for (Eigen::Index b = 0; b < walls; ++b) {
      const Vec3 x_ib = shortest(s.domain, x.col(i) - wall.position.col(b));
      const double r = x_ib.norm(), V = fields.boundary_volume[b];
      if (r >= H) continue;
      fields.wall_pressure_acceleration.col(i) += rho0 * V * q[i] * kernel.G(r) * x_ib;
      size(2, i) += rho0 * V * q_size[i] * kernel.slope(r);
      const Vec3 drag = s.fluid.wall_viscosity / rho[i] * V * (wall.velocity.col(b) - v.col(i)) * kernel.L(r);
      fields.wall_viscous_acceleration.col(i) += drag;
      size(3, i) += drag.norm();
    }
  }
  fields.acceleration = (fields.pressure_acceleration + fields.viscous_acceleration +
                         fields.wall_pressure_acceleration + fields.wall_viscous_acceleration)
                            .colwise() +
                        s.gravity;
}

/// Every field of the reference as it should be, each to `tolerance` of the size of its terms.
template <class Real>
bool as_expected(const Case& c, double tolerance, const StageInputs& given = {}) {
  const Expected expected(c, given);
  const PosedWalls posed = c.posed();
  Neighbors neighbors;
  find_neighbors(c.scene, c.state.position, posed.position, NeighborSearch::cells, neighbors);
  Fields out;
  const Eigen::VectorXd volumes = boundary_volumes<Real>(c.scene, c.walls);
  evaluate<Real>(c.scene, c.state, posed, volumes, neighbors, out, &given);
  const Fields& e = expected.fields;
  const auto near = [&](const auto& found, const auto& right, const auto& size) {
    return ((found - right).array().abs() <= tolerance * size.array()).all();
  };
  const auto near_columns = [&](const Eigen::Matrix3Xd& found, const Eigen::Matrix3Xd& right,
                                const Eigen::RowVectorXd& size) {
    return ((found - right).colwise().norm().array() <= tolerance * size.array()).all();
  };
  const Eigen::RowVectorXd all = expected.size.colwise().sum().array() + c.scene.gravity.norm();
  return near(out.boundary_volume, e.boundary_volume, e.boundary_volume) && near(out.density, e.density, e.density) &&
         near(out.pressure, e.pressure, expected.pressure_size) &&
         near_columns(out.pressure_acceleration, e.pressure_acceleration, expected.size.row(0)) &&
         near_columns(out.viscous_acceleration, e.viscous_acceleration, expected.size.row(1)) &&
         near_columns(out.wall_pressure_acceleration, e.wall_pressure_acceleration, expected.size.row(2)) &&
         near_columns(out.wall_viscous_acceleration, e.wall_viscous_acceleration, expected.size.row(3)) &&
         near_columns(out.acceleration, e.acceleration, all) && out.fluid_neighbor_count == e.fluid_neighbor_count &&
         out.fluid_neighbor_id_sum == e.fluid_neighbor_id_sum && out.wall_neighbor_count == e.wall_neighbor_count &&
         out.wall_neighbor_id_sum == e.wall_neighbor_id_sum;
}

TEST(Fields, AreWhatADoubleLoopOverTheFormulasGives) {
  EXPECT_TRUE(rc::check("evaluate == loop", [] {
    const auto family = families[static_cast<std::size_t>(integer(0, 2))];
    Case c = random_case(family, integer(0, 1 << 30), integer(1, 60), real(0.8, 3), integer(0, 30));
    c.scene.support_ratio = real(1.5, 3);
    c.scene.mass_ratio = real(0.8, 1.2);
    c.scene.fluid.eos_exponent = coin() ? 7 : 1;
    c.scene.fluid.allow_tension = coin();
    c.scene.fluid.viscosity = real(0, 1);
    c.scene.fluid.wall_viscosity = real(0, 1);
    RC_ASSERT(as_expected<double>(c, 1e-12));
  }));
}

TEST(Fields, AreRightAcrossAPeriod) {
  for (const auto family : families) {
    Case c = random_case(family, 17, 80, 2.5, 30, false);  // nothing may tilt through a period
    const double half = 1.25 * c.scene.support_radius();
    c.scene.domain = {Vec3(-half, -half, -1), Vec3(half, half, 1), {true, true, false}};
    EXPECT_TRUE(as_expected<double>(c, 1e-12));
  }
}

TEST(Fields, AreRightToRoundingInSinglePrecision) {
  for (const auto family : families)
    for (const double size : {1.2, 2.0, 3.0}) {
      Case c = random_case(family, 23, 60, size, 30);
      c.state.quantise();
      EXPECT_TRUE(as_expected<float>(c, 1e-4)) << size;
      EXPECT_FALSE(as_expected<float>(c, 1e-9)) << size;
    }
}

TEST(Fields, FollowFromTheDensityAndPressureThatAreGiven) {
  const Case c = random_case(KernelFamily::cubic_spline, 5, 40, 1.5, 20);
  StageInputs given;
  given.density = Eigen::VectorXd::LinSpaced(40, 900, 1300);
  EXPECT_TRUE(as_expected<double>(c, 1e-12, given));
  given.pressure = Eigen::VectorXd::LinSpaced(40, -1e3, 1e4);
  EXPECT_TRUE(as_expected<double>(c, 1e-12, given));
  given.density.resize(0);
  EXPECT_TRUE(as_expected<double>(c, 1e-12, given));
}

TEST(Fields, OfAParticleAloneAreItsOwn) {
  const double pi = PlainKernel::pi;
  const double at_zero[] = {1 / pi, 21 / (16 * pi), 315 / (512 * pi)};  // h³ W(0)
  for (const auto family : families) {
    const Scene scene = open_scene(family);  // h = dx, so that m W(0) = rho0 h³ W(0)
    Fields out;
    Solver(scene, {}, state_of(Vec3(0.1, -0.2, 0.3), Vec3(1, 2, 3))).fields(out);
    EXPECT_NEAR(out.density[0], 1000 * at_zero[static_cast<int>(family)], 1e-10);
    EXPECT_EQ(out.pressure[0], 0);
    EXPECT_EQ(Vec3(out.acceleration.col(0)), scene.gravity);
    EXPECT_EQ(out.fluid_neighbor_count[0], 0);
    EXPECT_EQ(out.fluid_neighbor_id_sum[0], 0);
    EXPECT_EQ(out.wall_neighbor_count[0], 0);
  }
}

TEST(Fields, FeelNothingFromBeyondTheSupport) {
  for (const auto family : families) {
    Scene scene = open_scene(family);
    Eigen::Matrix3Xd x(3, 2);
    x << 0, scene.support_radius() * 1.0001, 0, 0, 0, 0;
    Fields pair, alone;
    Solver(scene, {}, state_of(x, Eigen::Matrix3Xd::Random(3, 2))).fields(pair);
    Solver(scene, {}, state_of(x.leftCols(1), x.leftCols(1))).fields(alone);
    EXPECT_EQ(pair.density, alone.density.replicate(2, 1));
    EXPECT_EQ(pair.acceleration, scene.gravity.replicate(1, 2));
  }
}

TEST(Fields, ArePutAtTheTimeOfTheState) {
  const Case c = random_case(KernelFamily::cubic_spline, 31, 40, 1.5, 20);
  const Expected expected(c);  // with the walls as they stand at substep 400
  Fields out;
  Solver(c.scene, c.walls, c.state).fields(out);
  EXPECT_LT((out.acceleration - expected.fields.acceleration).norm(), 1e-12 * expected.size.sum());
  EXPECT_LT((out.density - expected.fields.density).norm(), 1e-12 * out.density.norm());
}

}  // namespace
}  // namespace decant::test
