/// \file
/// The schedules of tilt and translation and the rigid motion that follows from them.
#include "reference/pose.hpp"
#include "reference/shapes.hpp"
#include "reference/solver.hpp"
#include "tests/generators.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace decant::test {
namespace {

/// Turns forth, rests, turns back.
Tilt there_and_back() {
  return {Vec3(0.1, -0.2, 0.3), Vec3(2, -1, 2) / 3, {{0.5, 0.1}, {1.5, 1.3}, {2, 1.3}, {4, -0.4}}};
}

Container tilting_cup() {
  Container cup{"cup", cup_shape(0.05, 0.1, 0.04), Vec3(-0.3, 0.2, 0.4), 0.04, there_and_back()};
  return cup;
}

TEST(TiltAngle, RestsBeforeTheFirstKeyAndAfterTheLast) {
  const Tilt tilt = there_and_back();
  for (const double t : {-1.0, 0.0, 0.49, 0.5}) {
    EXPECT_EQ(tilt_at(tilt, t).angle, 0.1) << t;
    EXPECT_EQ(tilt_at(tilt, t).rate, 0) << t;
  }
  for (const double t : {4.0, 4.01, 1e9}) {
    EXPECT_EQ(tilt_at(tilt, t).angle, -0.4) << t;
    EXPECT_EQ(tilt_at(tilt, t).rate, 0) << t;
  }
}

TEST(TiltAngle, MeetsEveryKeyAndStandsStillThere) {
  for (const TiltKey& key : there_and_back().keys)
    for (const double t : {key.time - 1e-12, key.time, key.time + 1e-12}) {
      EXPECT_NEAR(tilt_at(there_and_back(), t).angle, key.angle, 1e-15);
      EXPECT_NEAR(tilt_at(there_and_back(), t).rate, 0, 1e-10);
    }
}

TEST(TiltAngle, FollowsTheSmoothstepBetweenKeys) {
  const Tilt tilt = there_and_back();
  // 3s² − 2s³ is 5/32, 1/2, 27/32 at s = 1/4, 1/2, 3/4; its slope 6s(1 − s) is 9/8, 3/2, 9/8.
  EXPECT_NEAR(tilt_at(tilt, 0.75).angle, 0.1 + 1.2 * 5 / 32, 1e-15);
  EXPECT_NEAR(tilt_at(tilt, 0.75).rate, 1.2 * 9 / 8, 1e-14);
  EXPECT_NEAR(tilt_at(tilt, 1.0).angle, 0.7, 1e-15);
  EXPECT_NEAR(tilt_at(tilt, 1.0).rate, 1.2 * 3 / 2, 1e-14);
  EXPECT_NEAR(tilt_at(tilt, 1.75).angle, 1.3, 1e-15);
  EXPECT_EQ(tilt_at(tilt, 1.75).rate, 0);
  EXPECT_NEAR(tilt_at(tilt, 3.5).angle, 1.3 - 1.7 * 27 / 32, 1e-15);
  EXPECT_NEAR(tilt_at(tilt, 3.5).rate, -1.7 * 9 / 8 / 2, 1e-14);
}

TEST(TiltAngle, HasARateThatIsItsDerivative) {
  EXPECT_TRUE(rc::check("rate == d angle / dt", [] {
    Tilt tilt{Vec3::Zero(), Vec3::UnitX(), {}};
    const int keys = integer(1, 5);
    for (int k = 0; k < keys; ++k) tilt.keys.push_back({k + real(0, 0.8), real(-3, 3)});
    const double t = real(-1, 6), d = 1e-5;
    const double slope = (tilt_at(tilt, t + d).angle - tilt_at(tilt, t - d).angle) / (2 * d);
    // Across a key the rate is still continuous, with a kink: |turn|·6/span² of at most 900.
    RC_ASSERT(std::abs(tilt_at(tilt, t).rate - slope) <= 900 * d);
  }));
}

/// Anything that a schedule may say.
Tilt any_tilt() {
  Tilt tilt{vec(-1, 1), vec(0.1, 1).normalized(), {}};
  const int keys = integer(1, 5);
  for (int k = 0; k < keys; ++k) tilt.keys.push_back({k + real(0, 0.8), real(-3, 3)});
  if (coin()) tilt.rate = real(-9, 9);
  if (coin()) tilt.oscillation = {real(-1, 1), real(0.1, 2), real(-4, 4)};
  return tilt;
}

Translation any_translation() {
  Translation translation;
  translation.keys.clear();
  const int keys = integer(1, 5);
  for (int k = 0; k < keys; ++k) translation.keys.push_back({k + real(0, 0.8), vec(-3, 3)});
  if (coin()) translation.velocity = vec(-9, 9);
  if (coin()) translation.oscillation = {vec(-1, 1), real(0.1, 2), real(-4, 4)};
  return translation;
}

/// Whether t is a time at which a schedule of one key starts at once.
template <class Key>
bool starts_at(const std::vector<Key>& keys, double t, double d) {
  return keys.size() == 1 && std::abs(t - keys[0].time) <= d;
}

TEST(Schedules, HaveRatesThatAreTheirDerivativesWhateverTheySay) {
  EXPECT_TRUE(rc::check("rate == d value / dt", [] {
    const Tilt tilt = any_tilt();
    const Translation translation = any_translation();
    const double t = real(-1, 7), d = 1e-5;
    // A kink of |turn|·6/span² at a key, 3 |rate|/span more where the rate goes on.
    if (!starts_at(tilt.keys, t, d)) {
      const double slope = (tilt_at(tilt, t + d).angle - tilt_at(tilt, t - d).angle) / (2 * d);
      RC_ASSERT(std::abs(tilt_at(tilt, t).rate - slope) <= 1200 * d);
    }
    if (!starts_at(translation.keys, t, d)) {
      const Vec3 slope =
          (translation_at(translation, t + d).offset - translation_at(translation, t - d).offset) / (2 * d);
      RC_ASSERT((translation_at(translation, t).velocity - slope).norm() <= 2400 * d);
    }
  }));
}

TEST(Schedules, MeetTheRateAfterTheLastKeyWithoutAJump) {
  const Tilt tilt{Vec3::Zero(), Vec3::UnitX(), {{0, 0.0}, {1, 0.5}, {3, 2.5}}, 4};
  EXPECT_EQ(tilt_at(tilt, 3).rate, 4);
  EXPECT_NEAR(tilt_at(tilt, 3 - 1e-9).rate, 4, 1e-7);
  EXPECT_NEAR(tilt_at(tilt, 1 + 1e-9).rate, 0, 1e-7);
  // Halfway: 1/2 of the turn and rate · T (1/8 − 1/4); 3/2 of the mean rate and rate (3/4 − 1).
  EXPECT_NEAR(tilt_at(tilt, 2).angle, 0.5 + 2.0 / 2 - 4.0 * 2 / 8, 1e-15);
  EXPECT_NEAR(tilt_at(tilt, 2).rate, 1.5 * 2 / 2 - 4.0 / 4, 1e-15);
  // The span before the last ends at rest.
  EXPECT_NEAR(tilt_at(tilt, 0.5).rate, 1.5 * 0.5, 1e-15);
  EXPECT_EQ(tilt_at(tilt, 10).angle, 2.5 + 4 * 7);
}

TEST(Schedules, AddAnOscillationToWhatTheKeysSay) {
  Translation sway;
  sway.keys = {{0, Vec3(1, 0, 0)}, {2, Vec3(1, 2, 0)}};
  sway.oscillation = {Vec3(0, 0.5, 0.1), 0.25, std::numbers::pi / 2};
  // A quarter of a period on, a cosine is at 0 and falls; the keys are halfway.
  const TranslationOffset at = translation_at(sway, 1);
  EXPECT_LT((at.offset - Vec3(1, 1, 0)).norm(), 1e-15);
  EXPECT_LT((at.velocity - Vec3(0, 1.5, 0) + std::numbers::pi / 2 * Vec3(0, 0.5, 0.1)).norm(), 1e-15);
}

TEST(Pose, OfADrumAfterManyTurnsIsThatOfTheAngleThatRemains) {
  Container drum = tilting_cup();
  drum.tilt->keys = {{0.0, 0.25}};
  drum.tilt->rate = 3;
  const long double turn = 2 * std::numbers::pi_v<long double>;
  for (const double t : {1.0, 100.0, 1e4, 1e5}) {
    const double angle = 0.25 + 3 * t;
    const auto rest = static_cast<double>(std::remainder(static_cast<long double>(angle), turn));
    const Pose pose = pose_at(drum, t);
    const Eigen::Matrix3d turned = Eigen::AngleAxisd(rest, drum.tilt->axis).toRotationMatrix();
    EXPECT_LT((pose.rotation - turned).norm(), 1e-14) << t;
    EXPECT_LT((pose.angular_velocity - 3 * drum.tilt->axis).norm(), 1e-15) << t;
  }
}

TEST(Pose, TakesTheLineOfTheTiltAlong) {
  Container cup = tilting_cup();
  cup.translation.emplace().velocity = {1, -2, 0.5};
  const Pose still = pose_at(tilting_cup(), 1.2), pose = pose_at(cup, 1.2);
  const Vec3 way = 1.2 * cup.translation->velocity;
  EXPECT_EQ(pose.rotation, still.rotation);
  EXPECT_LT((pose.pivot - still.pivot - way).norm(), 1e-15);
  EXPECT_LT((pose.translation - still.translation - way).norm(), 1e-15);
  EXPECT_EQ(pose.linear_velocity, cup.translation->velocity);
  EXPECT_TRUE(moves(cup));
  cup.tilt.reset();
  EXPECT_TRUE(moves(cup));
  EXPECT_EQ(pose_at(cup, 1.2).velocity_at(Vec3(5, 6, 7)), cup.translation->velocity);
}

TEST(Pose, TurnsRightHandedAboutThePivot) {
  Container cup = tilting_cup();
  cup.tilt = Tilt{Vec3(1, 0, 1), Vec3::UnitY(), {{0, std::numbers::pi / 2}}};
  cup.origin = Vec3(1, 0, 2);
  // z turns to x: what stood 1 m above the pivot lies 1 m beside it.
  EXPECT_LT((pose_at(cup, 0).to_world(Vec3::Zero()) - Vec3(2, 0, 1)).norm(), 1e-15);
  EXPECT_LT((pose_at(cup, 0).to_world(Vec3(0, 3, 1)) - Vec3(3, 3, 1)).norm(), 1e-15);
}

TEST(Pose, LeavesAnUntiltedContainerAtItsOrigin) {
  Container cup = tilting_cup();
  EXPECT_TRUE(moves(cup));
  cup.tilt.reset();
  EXPECT_FALSE(moves(cup));
  const Pose pose = pose_at(cup, 1.2);
  EXPECT_EQ(pose.to_world(Vec3(1, 2, 3)), cup.origin + Vec3(1, 2, 3));
  EXPECT_EQ(pose.velocity_at(Vec3(1, 2, 3)), Vec3::Zero());
}

TEST(Pose, IsRigidAndUndoesItself) {
  EXPECT_TRUE(rc::check("to_local(to_world(x)) == x, distances kept", [] {
    const Pose pose = pose_at(tilting_cup(), real(0, 5));
    const Vec3 a = vec(-1, 1), b = vec(-1, 1);
    RC_ASSERT((pose.to_local(pose.to_world(a)) - a).norm() <= 1e-14);
    RC_ASSERT(std::abs((pose.to_world(a) - pose.to_world(b)).norm() - (a - b).norm()) <= 1e-14);
    RC_ASSERT(std::abs(pose.rotation.determinant() - 1) <= 1e-14);
  }));
}

TEST(Pose, KeepsThePivotLineWhereItIs) {
  const Container cup = tilting_cup();
  for (const double t : {0.0, 0.9, 1.7, 2.6, 5.0})
    for (const double along : {-2.0, 0.0, 0.7}) {
      const Vec3 point = cup.tilt->pivot + along * cup.tilt->axis;
      const Pose pose = pose_at(cup, t);
      EXPECT_LT((pose.to_world(point - cup.origin) - point).norm(), 1e-14) << t;
      EXPECT_LT(pose.velocity_at(point).norm(), 1e-14) << t;
    }
}

TEST(Pose, IsUprightWhereTheAngleIsZero) {
  Container cup = tilting_cup();
  cup.tilt->keys = {{1, 0.0}, {2, 1.0}};
  EXPECT_LT((pose_at(cup, 0.3).to_world(Vec3(1, 2, 3)) - cup.origin - Vec3(1, 2, 3)).norm(), 1e-14);
}

TEST(PosedWalls, MoveWithTheDerivativeOfTheirPosition) {
  Scene scene = open_scene();
  Container sway = tilting_cup(), both = tilting_cup();
  sway.tilt.reset();
  sway.translation.emplace().oscillation = {Vec3(0.1, 0, 0.02), 1.5, 0.3};
  both.tilt->rate = 5;
  both.tilt->oscillation = {0.2, 1.1, 0};
  both.translation.emplace().keys = {{0.5, Vec3::Zero()}, {2.5, Vec3(0.3, 0.1, -0.2)}};
  both.translation->velocity = {0.2, 0, 0};
  scene.containers = {tilting_cup(), tilting_cup(), sway, both};
  scene.containers[1].tilt.reset();
  const Walls walls{
      {{cloud(1, 20, -0.1, 0.1)}, {cloud(2, 5, -0.1, 0.1)}, {cloud(3, 9, -0.1, 0.1)}, {cloud(4, 9, -0.1, 0.1)}}};
  for (const double t : {0.2, 0.7, 1.1, 1.8, 2.3, 2.9, 5.3}) {
    // Of fourth order, so that 1e-9 is beyond both the formula's error and rounding.
    const double d = 3e-4;
    const auto at = [&](double time) { return pose_walls(scene, walls, time).position; };
    const Eigen::Matrix3Xd slope = (8 * (at(t + d) - at(t - d)) - (at(t + 2 * d) - at(t - 2 * d))) / (12 * d);
    const PosedWalls now = pose_walls(scene, walls, t);
    EXPECT_LT((now.velocity - slope).colwise().norm().maxCoeff(), 1e-9) << t;
    EXPECT_EQ(now.velocity.middleCols(20, 5).norm(), 0);
    EXPECT_GT(now.velocity.rightCols(18).colwise().norm().minCoeff(), 0);
  }
}

TEST(PosedWalls, StandInTheOrderOfTheContainers) {
  Scene scene = open_scene();
  scene.containers = {tilting_cup(), tilting_cup()};
  scene.containers[1].tilt.reset();
  const Walls walls{{{cloud(1, 20, -0.1, 0.1)}, {cloud(2, 5, -0.1, 0.1)}}};
  const PosedWalls posed = pose_walls(scene, walls, 1.1);
  ASSERT_EQ(posed.position.cols(), 25);
  EXPECT_EQ(Vec3(posed.position.col(7)),
            pose_at(scene.containers[0], 1.1).to_world(walls.containers[0].position.col(7)));
  EXPECT_EQ(Vec3(posed.position.col(22)), scene.containers[1].origin + Vec3(walls.containers[1].position.col(2)));
}

}  // namespace
}  // namespace decant::test
