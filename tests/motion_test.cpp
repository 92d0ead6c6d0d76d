/// \file
/// What walls that translate and turn do to fluid: a piston's work, what it pushes, a tank and a drum
/// that carry their fluid along.
#include "oracle/checks/audit.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "reference/shapes.hpp"
#include "reference/solver.hpp"
#include "tests/generators.hpp"
#include "tests/scene_folder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace decant::test {
namespace {

using test::scenes;

constexpr double dx = 0.01;    // m
constexpr double side = 0.06;  // m, of the cross-section, which repeats along y and z

Container slab(const std::string& name, double x, double thickness) {
  const SolidBox box{Vec3::Zero(), Vec3(thickness, side, side)};
  return {name, BoxShape{box, {box}, {false, true, true}}, Vec3(x, 0, 0), thickness, {}};
}

/// A column of fluid from x = 0 to `length` (m) with a piston at its left end, without gravity.
Scene column(double length) {
  Scene s;
  s.name = "column";
  s.particle_spacing = dx;
  s.fluid = {1000, 10, 7, true, 0, 0};
  s.gravity.setZero();
  s.domain = {Vec3(-0.1, 0, 0), Vec3(0.4, side, side), {false, true, true}};
  s.containers = {slab("piston", -0.02, 0.02)};
  Fill water;
  water.box = SolidBox{Vec3::Zero(), Vec3(length, side, side)};
  s.fills = {water};
  s.schedule.end = 0.1;
  s.schedule.frames = 10;
  return s;
}

/// J/kg that density rho holds beyond rest: the integral of p/rho² of the equation of state.
double elastic_energy(const Scene& s, double rho) {
  const double rest = s.fluid.rest_density, B = s.eos_stiffness();
  const auto integral = [&](double r) { return B * (std::pow(r / rest, 6) / (6 * rest) + 1 / r); };
  return integral(rho) - integral(rest);
}

TEST(Piston, PutsItsWorkIntoTheFluid) {
  Scene s = column(0.1);
  s.containers.push_back(slab("end", 0.1, 0.02));
  // 2 % of the length, in ten times the time that sound needs for it.
  s.containers[0].translation.emplace().keys = {{0, Vec3::Zero()}, {0.1, Vec3(0.002, 0, 0)}};
  s.schedule.courant = 0.1;
  s.schedule.substeps_per_frame = substeps_for(s);
  ASSERT_NO_THROW(check_scene(s, "column"));
  Solver solver(s, sample_walls(s), initial_state(s));
  const double m = s.particle_mass(), dt = s.time_step();
  const auto energy = [&](const Fields& f) {
    double sum = 0;
    for (Eigen::Index i = 0; i < solver.state().size(); ++i)
      sum += m * (0.5 * solver.state().velocity.col(i).squaredNorm() + elastic_energy(s, f.density[i]));
    return sum;
  };
  Fields f;
  solver.fields(f);
  const double before = energy(f);
  double work = 0;
  const int substeps = s.schedule.frames * s.schedule.substeps_per_frame;
  for (int k = 0; k < substeps; ++k) {
    const double speed = pose_at(s.containers[0], (k + 0.5) * dt).linear_velocity.x();
    for (Eigen::Index i = 0; i < f.density.size(); ++i)
      if (solver.state().position(0, i) < 0.05) work += m * f.wall_pressure_acceleration(0, i) * speed * dt;
    solver.substep();
    solver.fields(f);
  }
  const double mean_pressure = f.pressure.mean();
  EXPECT_GT(work, 0);
  EXPECT_NEAR((energy(f) - before) / work, 1, 0.02);
  // 2 % more density, and p = B ((rho / rho0)^7 − 1); the wall particles do not come closer.
  const double expected = s.eos_stiffness() * (std::pow(1 / 0.98, 7) - 1);
  EXPECT_NEAR(mean_pressure / expected, 1, 0.15);
}

TEST(Piston, PushesAllFluidAlongAndLetsNoneThrough) {
  Scene s = column(0.06);
  s.containers[0].translation.emplace().keys = {{0, Vec3::Zero()}};
  s.containers[0].translation->velocity = {2, 0, 0};  // at once, a fifth of the speed of sound
  s.schedule.substeps_per_frame = substeps_for(s);
  ASSERT_NO_THROW(check_scene(s, "column"));
  Solver solver(s, sample_walls(s), initial_state(s));
  Audit audit(s);
  audit.sample(solver.state());
  for (int frame = 0; frame < s.schedule.frames; ++frame) {
    for (int k = 0; k < s.schedule.substeps_per_frame; ++k) {
      solver.substep();
      const double face = 2 * s.time_at(solver.state().substep);
      ASSERT_GE(solver.state().position.row(0).minCoeff(), face + s.contact_distance() - 1e-9);
    }
    const AuditResult seen = audit.sample(solver.state());
    EXPECT_EQ(seen.crossed, 0);
    EXPECT_EQ(seen.inside, 0);
  }
  // All of it is on its way, and no slower than the piston.
  EXPECT_GE(solver.state().velocity.row(0).mean(), 2);
}

TEST(Audit, FollowsAPistonThatSweepsOverARestingParticle) {
  Scene s = column(0.06);
  s.schedule.substeps_per_frame = 100;
  s.containers[0].translation.emplace().velocity = {2, 0, 0};
  const auto at_rest = [](double x, std::int64_t substep) {
    ParticleState state = state_of(Vec3(x, 0.03, 0.03), Vec3::Zero());
    state.substep = substep;
    return state;
  };
  // In 500 substeps of 0.1 ms the piston goes 0.1 m and leaves the particle 50 mm behind its back.
  Audit audit(s);
  EXPECT_EQ(audit.sample(at_rest(0.03, 0)).inside, 0);
  const AuditResult swept = audit.sample(at_rest(0.03, 500));
  EXPECT_EQ(swept.inside, 0);
  EXPECT_EQ(swept.crossed, 1);
  // One that goes along is not crossed, nor is one that stays ahead.
  Audit along(s);
  along.sample(at_rest(0.03, 0));
  EXPECT_EQ(along.sample(at_rest(0.13, 500)).crossed, 0);
}

TEST(Tank, ThatMovesEvenlyIsOneThatStands) {
  Scene still = load_scene(scenes / "motion-sway.json");
  still.containers[0].tilt.reset();
  still.containers[0].translation.reset();
  still.domain.max.x() = 2;
  Scene moving = still;
  const Vec3 V(0.5, 0, 0);
  moving.containers[0].translation.emplace().velocity = V;
  moving.fills[0].velocity = V;
  const ParticleState start = initial_state(still), started = initial_state(moving);
  Solver a(still, sample_walls(still), start), b(moving, sample_walls(moving), started);
  const int substeps = 60;
  for (int k = 0; k < substeps; ++k) a.substep(), b.substep();
  const Vec3 way = still.time_at(substeps) * V;
  EXPECT_LT(((b.state().position - a.state().position).colwise() - way).norm(), 1e-9);
  EXPECT_LT(((b.state().velocity - a.state().velocity).colwise() - V).norm(), 1e-7);
}

TEST(CommittedMotionScenes, DoWhatTheirNamesSay) {
  const Scene piston = load_scene(scenes / "motion-piston.json");
  EXPECT_TRUE(piston.containers[1].translation.has_value());
  EXPECT_FALSE(piston.fills[0].around.empty());
  EXPECT_TRUE(piston.domain.periodic[1]);
  const Scene sway = load_scene(scenes / "motion-sway.json");
  EXPECT_TRUE(sway.containers[0].translation->oscillation && sway.containers[0].tilt->oscillation);
  const Scene drum = load_scene(scenes / "motion-drum.json");
  EXPECT_GT(tilt_at(*drum.containers[0].tilt, drum.schedule.end).angle, 4 * std::numbers::pi);
  EXPECT_LT(tilt_at(*drum.containers[1].tilt, drum.schedule.end).angle, -4 * std::numbers::pi);
}

}  // namespace
}  // namespace decant::test
