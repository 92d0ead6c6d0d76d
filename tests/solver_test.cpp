/// \file
/// One substep and many: free fall, contact, moving walls, periods, restarts and mirrors.
#include "reference/solver.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/shapes.hpp"
#include "tests/generators.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace decant::test {
namespace {

constexpr double dt = 1.0 / 1024;  // s, as open_scene has it

ParticleState after(const Scene& scene, const Walls& walls, const ParticleState& state, int substeps,
                    NeighborSearch search = NeighborSearch::cells) {
  Solver solver(scene, walls, state, search);
  for (int n = 0; n < substeps; ++n) solver.substep();
  return solver.state();
}

/// Gravity of 8 m/s², so that every number of a fall is exact in binary.
Scene falling_scene() {
  Scene scene = open_scene();
  scene.gravity = Vec3(0, 0, -8);
  return scene;
}

/// The cup and fluid of a small, fast pour.
Scene pour_scene() {
  Scene scene = open_scene();
  scene.fluid.sound_speed = 5;
  scene.containers = {{"cup", cup_shape(0.05, 0.1, 0.04), Vec3::Zero(), 0.04, {}}};
  scene.containers[0].tilt = Tilt{Vec3(0.07, 0, 0.1), Vec3::UnitY(), {{0.02, 0}, {0.3, 2}}};
  scene.fills = {{"cup", 0.06, {}, Vec3::Zero()}};
  scene.schedule.frames = 2048;
  return scene;
}

TEST(FreeFall, IsThatOfSemiImplicitEulerExactly) {
  const Scene scene = falling_scene();
  const ParticleState start = state_of(Vec3(0.25, 0.5, 0.75), Vec3(0.5, 0, 0.25));
  for (const int n : {1, 2, 100}) {
    const ParticleState end = after(scene, {}, start, n);
    EXPECT_EQ(end.substep, n);
    EXPECT_EQ(Vec3(end.velocity), Vec3(0.5, 0, 0.25 - 8 * n * dt));
    EXPECT_EQ(Vec3(end.position), Vec3(0.25 + 0.5 * n * dt, 0.5, 0.75 + 0.25 * n * dt - 8 * dt * dt * n * (n + 1) / 2));
  }
}

TEST(FreeFall, TakesADropsCentreAlongWhateverItsPartsDo) {
  const Scene scene = falling_scene();
  const ParticleState start = state_of(cloud(1, 60, 0.5, 0.53), cloud(2, 60, -0.5, 0.5));
  const int n = 50;
  const ParticleState end = after(scene, {}, start, n);
  const Vec3 v = start.velocity.rowwise().mean() + n * dt * scene.gravity;
  const Vec3 x = start.position.rowwise().mean() + n * dt * start.velocity.rowwise().mean() +
                 dt * dt * n * (n + 1) / 2 * scene.gravity;
  EXPECT_LT((end.velocity.rowwise().mean() - v).norm(), 1e-12);
  EXPECT_LT((end.position.rowwise().mean() - x).norm(), 1e-12);
  EXPECT_GT((end.velocity.col(0) - start.velocity.col(0) - n * dt * scene.gravity).norm(), 0.01);
}

TEST(Floor, StopsAFallAtTheContactDistance) {
  Scene scene = falling_scene();
  scene.floor = Floor{-0.25};
  const ParticleState end = after(scene, {}, state_of(Vec3(0, 0, -0.2), Vec3(0.5, -0.25, -3)), 500);
  EXPECT_NEAR(end.position(2), -0.25 + 0.25 * scene.particle_spacing, 1e-15);
  // Frictionless: the way along the floor goes on as before.
  EXPECT_LT((Vec3(end.velocity) - Vec3(0.5, -0.25, 0)).norm(), 1e-13);
  EXPECT_LT((end.position.topRows(2) - 500 * dt * Eigen::Vector2d(0.5, -0.25)).norm(), 1e-13);
}

TEST(Floor, SlowsASlideByFrictionTimesTheImpulseUntilItRests) {
  Scene scene = falling_scene();
  scene.floor = Floor{0};
  scene.contact.friction = 0.5;
  const ParticleState start = state_of(Vec3(0, 0, scene.contact_distance()), Vec3(0.6, -0.8, 0));
  // The floor takes 8 m/s² · t, friction half of it from 1 m/s: at rest after 1/4 s.
  for (const int n : {64, 128, 255})
    EXPECT_LT((Vec3(after(scene, {}, start, n).velocity) - (1 - 4 * n * dt) * Vec3(0.6, -0.8, 0)).norm(), 1e-12);
  EXPECT_LT(after(scene, {}, start, 257).velocity.norm(), 1e-12);
  EXPECT_LT(after(scene, {}, start, 400).velocity.norm(), 1e-12);
}

TEST(Contact, BouncesTheNormalPartByTheRestitution) {
  for (const double restitution : {0.0, 0.25, 1.0}) {  // at 1 the speed is kept
    Scene scene = open_scene();
    scene.gravity.setZero();
    scene.contact.restitution = restitution;
    scene.containers = {{"cup", cup_shape(0.05, 0.1, 0.04), Vec3(0.2, 0, 0), 0.04, {}}};
    const Walls no_particles{{{Eigen::Matrix3Xd(3, 0)}}};
    Eigen::Matrix3Xd x(3, 2), v(3, 2), bounced(3, 2);
    x << 0.235, 0.2, 0, 0, 0.05, 0.05;  // onto the bottom, and at the wall in +y
    v << -0.25, 0, 0, 2, -2, 1;
    bounced << -0.25, 0, 0, -2 * restitution, 2 * restitution, 1;
    const ParticleState end = after(scene, no_particles, state_of(x, v), 26);
    EXPECT_LT((end.velocity - bounced).norm(), 1e-12) << restitution;
  }
}

TEST(Contact, IsWithTheWallsOwnVelocity) {
  Scene scene = open_scene();
  scene.contact.restitution = 0.5;
  scene.contact.friction = 0.25;
  Pose turning;  // at x = (2, 0, 0) the wall moves with (0, 6, 0)
  turning.angular_velocity = Vec3(0, 0, 3);
  Vec3 x(2 - 0.0005, 0, 0), v(-1, 2, 0.0);
  // phi = 2 mm, phi_c = 2.5 mm, n = x: w = (−1, −4, 0), j = 1.5, slip 4 loses 0.25 · 1.5.
  EXPECT_TRUE(push_out(scene, 0.002, Vec3::UnitX(), turning, x, v));
  EXPECT_LT((x - Vec3(2, 0, 0)).norm(), 1e-15);
  EXPECT_LT((v - Vec3(0.5, 6 - 3.625, 0)).norm(), 1e-14);
}

TEST(Contact, IsWithASurfaceThatRuns) {
  Scene scene = open_scene();
  scene.contact.friction = 1;
  Container belt{"belt", cup_shape(1, 1, 0.1), Vec3::Zero(), 0.1, {}};
  belt.tilt = Tilt{Vec3::Zero(), Vec3::UnitZ(), {{0, std::numbers::pi / 2}}};
  belt.surface_velocity = {3, 0, 0};  // (0, 3, 0) in the world
  const Pose pose = pose_at(belt, 5);
  Vec3 x(2, 0, 0), v(-1, 0, 0);
  EXPECT_TRUE(push_out(scene, 0.002, Vec3::UnitX(), pose, x, v));
  // w = (−1, −3, 0), j = 1, slip 3 loses 1.
  EXPECT_LT((v - Vec3(0, 1, 0)).norm(), 1e-12);
}

TEST(Contact, LeavesWhatIsFarOrParts) {
  const Scene scene = open_scene();
  Vec3 x(1, 2, 3), v(-1, 0, 0);
  EXPECT_FALSE(push_out(scene, scene.contact_distance(), Vec3::UnitX(), Pose{}, x, v));
  EXPECT_EQ(x, Vec3(1, 2, 3));
  EXPECT_EQ(v, Vec3(-1, 0, 0));
  v = Vec3(1, 5, 0);  // parting: put at the distance, its velocity its own
  EXPECT_TRUE(push_out(scene, -0.0005, Vec3::UnitX(), Pose{}, x, v));
  EXPECT_LT((x - Vec3(1.003, 2, 3)).norm(), 1e-15);
  EXPECT_EQ(v, Vec3(1, 5, 0));
}

TEST(Contact, PushesOutOfTwoWallsThatMeetInOneSubstep) {
  Scene scene = open_scene();
  scene.gravity.setZero();
  scene.containers = {
      {"tank", tank_shape(Vec3(0.2, 0.1, 0.3), 0.04, {{{}, {}, {false, true}}}), Vec3::Zero(), 0.04, {}}};
  const Walls no_particles{{{Eigen::Matrix3Xd(3, 0)}}};
  const ParticleState start = state_of(Vec3(0.003, 0.05, 0.0035), Vec3(-2, 0.5, -3));
  const ParticleState end = after(scene, no_particles, start, 1);
  EXPECT_LT((Vec3(end.position) - Vec3(0.0025, 0.05 + 0.5 * dt, 0.0025)).norm(), 1e-15);
  EXPECT_LT((Vec3(end.velocity) - Vec3(0, 0.5, 0)).norm(), 1e-14);
}

TEST(MovingWalls, LetNothingThroughWhileACupPours) {
  const Scene scene = pour_scene();
  const Container& cup = scene.containers[0];
  const SolidDistance solid(cup);
  Solver solver(scene, sample_walls(scene), initial_state(scene));
  const Eigen::Index n = solver.state().size();
  std::vector<bool> poured(static_cast<std::size_t>(n), false);
  for (int substep = 1; substep <= 1200; ++substep) {
    solver.substep();
    const Pose pose = pose_at(cup, scene.time_at(substep));
    for (Eigen::Index i = 0; i < n; ++i) {
      const Vec3 x = pose.to_local(solver.state().position.col(i));
      const double distance = solid.at(x).distance;
      ASSERT_GE(distance, scene.contact_distance() * (1 - 1e-9)) << i << " at substep " << substep;
      if (poured[static_cast<std::size_t>(i)] || solid.in_cavity(x)) continue;
      ASSERT_GT(x.z(), 0.1) << i << " left, but not over the rim, at substep " << substep;
      poured[static_cast<std::size_t>(i)] = true;
    }
  }
  EXPECT_GT(std::count(poured.begin(), poured.end(), true), n / 2);
}

TEST(MovingWalls, SweepAlongWhatTheyMeet) {
  // A wall 4 cm thick turns about the z axis at up to 3 rad/s into a row of resting particles.
  Scene scene = open_scene();
  scene.gravity.setZero();
  const BoxShape wall{{Vec3(0, 0, 0), Vec3(0.5, 0.1, 0.1)}, {{Vec3(0, -0.04, -0.1), Vec3(0.5, 0, 0.1)}}, {}};
  scene.containers = {{"wall", wall, Vec3::Zero(), 0.04, Tilt{Vec3::Zero(), Vec3::UnitZ(), {{0, 0}, {1, 2}}}}};
  const Walls no_particles{{{Eigen::Matrix3Xd(3, 0)}}};
  ParticleState state = state_of(Eigen::Matrix3Xd::Zero(3, 8), Eigen::Matrix3Xd::Zero(3, 8));
  for (int i = 0; i < 8; ++i) state.position.col(i) = Vec3(0.05 + 0.04 * i, 0.05, 0);
  Solver solver(scene, no_particles, state);
  int met = 0;
  for (int n = 1; n <= 400; ++n) {
    solver.substep();
    const Pose pose = pose_at(scene.containers[0], scene.time_at(n));
    for (int i = 0; i < 8; ++i) {
      const Vec3 x = solver.state().position.col(i), v = solver.state().velocity.col(i);
      const Vec3 local = pose.to_local(x);
      if (local.x() > 0.5) continue;  // has slid off the end
      ASSERT_GE(local.y(), scene.contact_distance() * (1 - 1e-12)) << i << ", substep " << n;
      if (local.y() > scene.contact_distance() * (1 + 1e-12)) continue;
      ++met;
      // Carried along by the wall at t + dt: no approach is left.
      EXPECT_NEAR((v - pose.velocity_at(x)).dot(pose.rotation * Vec3::UnitY()), 0, 1e-12);
    }
  }
  EXPECT_GT(met, 100);
}

TEST(PeriodicAxes, WrapPositionsAndLeaveVelocitiesAlone) {
  Scene scene = open_scene();
  scene.gravity.setZero();
  scene.domain = {Vec3(-0.25, 0, -1), Vec3(0.25, 0.125, 1), {true, true, false}};
  Eigen::Matrix3Xd x(3, 2), v(3, 2);
  x << 0.2, -0.125, 0.0625, 0.0625, 0, 0.5;
  v << 3, -7, 11, -2, 0.5, -0.25;
  ParticleState state = state_of(x, v);
  for (int n = 1; n <= 300; ++n) {
    state = after(scene, {}, state, 1);
    EXPECT_EQ(state.velocity, v);
    const Eigen::Matrix3Xd turns =
        scene.domain.max.cwiseMax(0).cwiseInverse().asDiagonal() * (x + n * dt * v - state.position);
    for (int i = 0; i < 2; ++i) {
      EXPECT_GE(state.position(0, i), -0.25);
      EXPECT_LT(state.position(0, i), 0.25);
      EXPECT_GE(state.position(1, i), 0);
      EXPECT_LT(state.position(1, i), 0.125);
      EXPECT_NEAR(turns(0, i), 2 * std::round(turns(0, i) / 2), 1e-12) << "period 0.5 = 2 · 0.25";
      EXPECT_NEAR(turns(1, i), std::round(turns(1, i)), 1e-12);
      EXPECT_NEAR(turns(2, i), 0, 1e-12);
    }
  }
}

TEST(Solver, GoesOnFromAStateAsIfItHadNeverStopped) {
  const Scene scene = pour_scene();
  const Walls walls = sample_walls(scene);
  const ParticleState start = initial_state(scene);
  const ParticleState straight = after(scene, walls, start, 80);
  const ParticleState resumed = after(scene, walls, after(scene, walls, start, 47), 33);
  EXPECT_EQ(resumed.substep, 80);
  EXPECT_EQ(resumed.position, straight.position);
  EXPECT_EQ(resumed.velocity, straight.velocity);
  EXPECT_NE(straight.position, start.position);
}

TEST(Solver, GivesTheSameBitsWithEitherSearch) {
  const Scene scene = pour_scene();
  const Walls walls = sample_walls(scene);
  const ParticleState by_cells = after(scene, walls, initial_state(scene), 40);
  const ParticleState by_pairs = after(scene, walls, initial_state(scene), 40, NeighborSearch::all_pairs);
  EXPECT_EQ(by_cells.position, by_pairs.position);
  EXPECT_EQ(by_cells.velocity, by_pairs.velocity);
}

TEST(Solver, TakesAMirroredSceneToAMirroredResult) {
  Scene scene = pour_scene();
  scene.gravity = Vec3(1, 2, -9.81);
  Walls walls = sample_walls(scene);
  ParticleState start = initial_state(scene);
  start.velocity = cloud(7, static_cast<int>(start.size()), -0.3, 0.3);
  const ParticleState end = after(scene, walls, start, 100);
  scene.gravity.y() *= -1;  // a turn about y is its own mirror image in y
  walls.containers[0].position.row(1) *= -1;
  start.position.row(1) *= -1;
  start.velocity.row(1) *= -1;
  ParticleState mirrored = after(scene, walls, start, 100);
  mirrored.position.row(1) *= -1;
  mirrored.velocity.row(1) *= -1;
  EXPECT_LT((mirrored.position - end.position).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((mirrored.velocity - end.velocity).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_GT(end.position.row(1).mean(), 1e-4);
}

}  // namespace
}  // namespace decant::test
