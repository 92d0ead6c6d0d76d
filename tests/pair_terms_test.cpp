/// \file
/// What a pair exchanges: equal and opposite, of the right size and sign; and a cloud that is left
/// alone keeps its momentum.
#include "reference/pair_terms.hpp"
#include "reference/solver.hpp"
#include "tests/generators.hpp"
#include "tests/plain_kernel.hpp"

#include <gtest/gtest.h>

namespace decant::test {
namespace {

/// Two particles of equal mass, 1 a pair's first, and their kernel values.
struct Pair {
  double mass = real(1e-6, 1), viscosity = real(0, 1);
  double rho_1 = real(500, 2000), rho_2 = real(500, 2000);
  double q_1 = real(-1, 1), q_2 = real(-1, 1);
  double G = real(0, 1e8), L = real(0, 1e8);
  Vec3 x_12 = vec(-0.02, 0.02), v_1 = vec(-5, 5), v_2 = vec(-5, 5);
};

Vec3 viscous_on_1(const Pair& p) { return viscous_term(p.viscosity, p.mass, p.rho_1, p.rho_2, p.v_1, p.v_2, p.L); }

Vec3 viscous_on_2(const Pair& p) { return viscous_term(p.viscosity, p.mass, p.rho_2, p.rho_1, p.v_2, p.v_1, p.L); }

TEST(PairTerms, PushBothPartnersEquallyAndOppositely) {
  EXPECT_TRUE(rc::check("m a_12 == −m a_21", [] {
    const Pair p;
    const Vec3 on_1 = pressure_term(p.mass, p.q_1, p.q_2, p.G, p.x_12);
    const Vec3 on_2 = pressure_term(p.mass, p.q_2, p.q_1, p.G, Vec3(-p.x_12));
    RC_ASSERT(on_1 == -on_2);
  }));
}

TEST(PairTerms, DragBothPartnersEquallyAndOppositely) {
  EXPECT_TRUE(rc::check("m a_12 == −m a_21 to rounding", [] {
    const Pair p;
    const Vec3 on_1 = viscous_on_1(p), on_2 = viscous_on_2(p);
    RC_ASSERT((on_1 + on_2).norm() <= 2e-15 * on_1.norm());
  }));
}

TEST(PairTerms, DoNotDragWhatMovesAlong) {
  EXPECT_TRUE(rc::check("v_1 == v_2 gives nothing", [] {
    Pair p;
    p.v_2 = p.v_1;
    RC_ASSERT(viscous_on_1(p) == Vec3::Zero());
    RC_ASSERT(wall_viscous_term(p.viscosity, p.mass, p.rho_1, p.v_1, p.v_2, p.L) == Vec3::Zero());
  }));
}

TEST(PairTerms, DragTowardsThePartnersVelocityAndSoTakeEnergy) {
  EXPECT_TRUE(rc::check("power <= 0", [] {
    const Pair p;
    RC_ASSERT(viscous_on_1(p).dot(p.v_1 - p.v_2) <= 0);
    const Vec3 by_wall = wall_viscous_term(p.viscosity, p.mass, p.rho_1, p.v_1, p.v_2, p.L);
    RC_ASSERT(by_wall.dot(p.v_1 - p.v_2) <= 0);
  }));
}

TEST(PairTerms, PushApartUnderPressureAndTogetherUnderTension) {
  const Vec3 x_12(0.003, -0.004, 0);
  EXPECT_GT(pressure_term(1.0, 2.0, 3.0, 4.0, x_12).dot(x_12), 0);
  EXPECT_LT(pressure_term(1.0, -2.0, -3.0, 4.0, x_12).dot(x_12), 0);
  EXPECT_GT(wall_pressure_term(1.0, 2.0, 3.0, 4.0, x_12).dot(x_12), 0);
}

TEST(PairTerms, HaveTheValuesThatTheirFormulasGive) {
  EXPECT_EQ(density_term(3.0, 5.0), 15);
  EXPECT_EQ(wall_density_term(7.0, 3.0, 5.0), 105);
  // m (q_i + q_j) G x and rho0 V q_i G x, x = (1, −2, 4)
  EXPECT_EQ(pressure_term(3.0, 5.0, 7.0, 11.0, Vec3(1, -2, 4)), Vec3(396, -792, 1584));
  EXPECT_EQ(wall_pressure_term(3.0, 5.0, 7.0, 11.0, Vec3(1, -2, 4)), Vec3(1155, -2310, 4620));
  // 3/8 · 5/4 · 2 · (v_j − v_i) and 3/8 · 5 · 2 · (v_b − v_i), where the difference is (1, −2, 4)
  const Vec3 v_i(1, 1, 1), v_j(2, -1, 5);
  EXPECT_EQ(viscous_term(3.0, 5.0, 8.0, 4.0, v_i, v_j, 2.0), 0.9375 * Vec3(1, -2, 4));
  EXPECT_EQ(wall_viscous_term(3.0, 5.0, 8.0, v_i, v_j, 2.0), 3.75 * Vec3(1, -2, 4));
}

TEST(Pressure, FollowsTheEquationOfState) {
  EXPECT_EQ(pressure_of(1000.0, 1000.0, 1e5, 7.0, true), 0);
  EXPECT_EQ(pressure_of(2000.0, 1000.0, 1e5, 7.0, false), 127e5);
  EXPECT_EQ(pressure_of(1250.0, 1000.0, 1e5, 1.0, false), 0.25e5);
  EXPECT_EQ(pressure_of(500.0, 1000.0, 1e5, 1.0, true), -0.5e5);
  EXPECT_EQ(pressure_of(500.0, 1000.0, 1e5, 1.0, false), 0);
  EXPECT_EQ(pressure_of(500.0, 1000.0, 1e5, 7.0, false), 0);
}

TEST(Pressure, CarriesSoundAtTheScenesSpeed) {
  for (const double gamma : {1.0, 7.0}) {
    Scene scene = open_scene();
    scene.fluid.eos_exponent = gamma;
    scene.fluid.sound_speed = 12;
    const auto p = [&](double density) { return pressure_of(density, 1000.0, scene.eos_stiffness(), gamma, true); };
    EXPECT_NEAR((p(1000.01) - p(999.99)) / 0.02, 144, 1e-4) << "dp/drho = c0², gamma " << gamma;
  }
}

/// Particles without walls or gravity, some on a periodic domain.
struct ClosedCloud {
  Scene scene = open_scene(families[static_cast<std::size_t>(integer(0, 2))]);
  ParticleState state;
  Fields fields;

  explicit ClosedCloud(bool periodic) {
    scene.gravity.setZero();
    scene.fluid.allow_tension = coin();
    const int n = integer(2, 80);
    const double size = scene.support_radius() * real(1, 3);
    if (periodic) scene.domain = {Vec3::Constant(-size), Vec3::Constant(size), {true, true, true}};
    state = state_of(any_cloud(n, -size, size), any_cloud(n, -2, 2));
    Solver(scene, {}, state).fields(fields);
  }
};

TEST(ClosedClouds, KeepTheirMomentum) {
  EXPECT_TRUE(rc::check("sum of m a == 0 to rounding", [] {
    const ClosedCloud c(coin());
    const Eigen::Matrix3Xd& a = c.fields.acceleration;
    RC_ASSERT(a.rowwise().sum().norm() <= 1e-13 * a.colwise().norm().sum());
  }));
}

TEST(ClosedClouds, KeepTheirAngularMomentumUnderPressure) {
  EXPECT_TRUE(rc::check("sum of x × m a == 0 to rounding", [] {
    const ClosedCloud c(false);
    Vec3 torque = Vec3::Zero();
    double scale = 0;
    for (Eigen::Index i = 0; i < c.state.size(); ++i) {
      const Vec3 x = c.state.position.col(i), a = c.fields.pressure_acceleration.col(i);
      torque += x.cross(a);
      scale += x.norm() * a.norm();
    }
    RC_ASSERT(torque.norm() <= 1e-13 * scale);
  }));
}

}  // namespace
}  // namespace decant::test
