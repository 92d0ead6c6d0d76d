/// \file
/// A run that leaves what its time step and its speed of sound were chosen for says where.
#include "tools/pour/limits.hpp"

#include "gpu/backends.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "reference/scene_checks.hpp"
#include "reference/shapes.hpp"
#include "tests/falling_points.hpp"
#include "tools/pour/pour.hpp"
#include "tools/pour/pour_report.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>

namespace decant {
namespace {

using test::FallingPoints;

TEST(Limits, AreTheSpeedThatTheStepIsDerivedForAQuarterOfSoundAndItsCompression) {
  Scene scene = test::falling_points_scene();
  scene.schedule.max_speed = 2.0;
  scene.fluid.sound_speed = 20;
  scene.fluid.rest_density = 900;
  const SceneLimits derived = limits_of(scene);
  EXPECT_EQ(derived.time_step_speed, 2.0);
  EXPECT_EQ(derived.sound_speed_quarter, 20 / 4.0);
  EXPECT_EQ(derived.density, 900 * (1 + 1 / 16.0));
  // A step half as long as the speed needs allows for more: 0.4 h/dt − c0.
  scene.schedule.substeps_derived = false;
  scene.schedule.substeps_per_frame = 2 * substeps_for(scene);
  const double h = scene.smoothing_length();
  EXPECT_EQ(limits_of(scene).time_step_speed, 0.4 * h / scene.time_step() - 20);
  EXPECT_GE(limits_of(scene).time_step_speed, 2 * (20 + 2.0) - 20);
}

TEST(Limits, NameTheFirstFrameAndParticleBeyondAndTheLargestOfAll) {
  std::vector<pour::TimelineRow> rows(5);
  for (std::size_t f = 0; f < rows.size(); ++f) {
    rows[f].frame = static_cast<std::int64_t>(f);
    rows[f].max_speed = 1;
    rows[f].max_density = 1000;
    rows[f].fastest_particle = static_cast<std::int64_t>(10 + f);
    rows[f].densest_particle = static_cast<std::int64_t>(20 + f);
  }
  const SceneLimits limits{2, 5, 1100};
  EXPECT_TRUE(pour::limits_exceeded(rows, limits).empty());
  rows[2].max_speed = 3;
  rows[3].max_speed = 4;
  auto found = pour::limits_exceeded(rows, limits);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].limit, "time_step_speed");
  EXPECT_EQ(found[0].frame, 2);
  EXPECT_EQ(found[0].particle, 12);
  EXPECT_EQ(found[0].value, 3);
  EXPECT_EQ(found[0].largest, 4);
  EXPECT_EQ(found[0].frames, 2);
  rows[4].max_speed = std::numeric_limits<double>::quiet_NaN();
  rows[1].max_density = 1101;
  found = pour::limits_exceeded(rows, limits);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[1].limit, "sound_speed_quarter");
  EXPECT_EQ(found[1].frame, 4);
  EXPECT_TRUE(std::isnan(found[1].largest));
  EXPECT_EQ(found[2].limit, "density");
  EXPECT_EQ(found[2].particle, 21);
  // What was NaN once is not forgotten for what comes later.
  rows[1].max_speed = rows[4].max_speed;
  rows[4].max_speed = 6;
  found = pour::limits_exceeded(rows, limits);
  EXPECT_TRUE(std::isnan(found[0].largest));
  EXPECT_TRUE(std::isnan(found[1].largest));
}

/// Under tension this fluid tears itself to pieces, ten times as fast as its container is tall.
Scene tearing_scene() {
  Scene scene;
  scene.name = "tension";
  scene.particle_spacing = 0.004;
  scene.kernel = KernelFamily::mueller2003;
  scene.mass_ratio = 0.9902951079421667;
  scene.fluid.eos_exponent = 1;
  scene.fluid.allow_tension = true;
  scene.fluid.viscosity = scene.fluid.wall_viscosity = 0;
  scene.domain = {Vec3::Constant(-0.2), Vec3::Constant(0.2), {}};
  scene.containers.push_back({"cup", cup_shape(0.02, 0.05, 0.009), Vec3(-0.03, 0, 0.02), 0.009, {}});
  Fill water;
  water.container = "cup";
  water.level = 0.03;
  scene.fills.push_back(water);
  scene.schedule.end = 0.03;
  scene.schedule.frames = 3;
  scene.schedule.substeps_per_frame = substeps_for(scene);
  return scene;
}

TEST(Limits, ThatAPourPassesAreInItsSummaryAndInItsJson) {
  const TemporaryFolder folder;
  const Scene scene = tearing_scene();
  pour::Options options;
  options.out = folder / "out";
  options.quiet = true;
  const auto backend = make_backend("hash", Executor::host);
  testing::internal::CaptureStderr();
  options.quiet = false;
  const pour::Result result = pour::run(scene, *backend, options);
  const std::string told = testing::internal::GetCapturedStderr();
  ASSERT_EQ(result.limits_exceeded.size(), 3u);
  EXPECT_GT(result.limits_exceeded[1].largest, scene.fluid.sound_speed / 4);
  EXPECT_GT(result.limits_exceeded[2].largest, 1000 * (1 + 1 / 16.0));
  for (const pour::LimitExceeded& e : result.limits_exceeded) {
    EXPECT_NE(told.find("warning: " + describe(e)), std::string::npos) << told;
    const pour::TimelineRow& row = result.timeline.rows.at(static_cast<std::size_t>(e.frame));
    EXPECT_EQ(e.value, e.limit == "density" ? row.max_density : row.max_speed);
    EXPECT_GE(e.particle, 0);
  }
  const auto json = nlohmann::json::parse(pour::result_json(result, backend->info(), "out"));
  EXPECT_EQ(json.at("within_limits"), false);
  EXPECT_EQ(json.at("limits_exceeded").size(), 3u);
  EXPECT_EQ(json.at("limits_exceeded")[1].at("limit").get<std::string>(), "sound_speed_quarter");
  EXPECT_EQ(json.at("limits_exceeded")[1].at("bound").get<double>(), 10 / 4.0);
  EXPECT_EQ(json.at("limits_exceeded")[1].at("particle").get<std::int64_t>(), result.limits_exceeded[1].particle);
}

TEST(Limits, ThatHoldAreNotComplainedOf) {
  const TemporaryFolder folder;
  Scene scene = test::falling_points_scene();
  FallingPoints backend;
  pour::Options options;
  options.out = folder / "out";
  options.quiet = true;
  const pour::Result result = pour::run(scene, backend, options);
  EXPECT_TRUE(result.limits_exceeded.empty());
  EXPECT_EQ(nlohmann::json::parse(pour::result_json(result, backend.info(), "out")).at("within_limits"), true);
}

TEST(ExpectedSpeed, IsThatOfTheFastestWallWhateverItHolds) {
  Scene scene = test::falling_points_scene();
  scene.schedule.max_speed.reset();
  scene.gravity.setZero();
  // The tilting cup is empty. Its outer bottom rim is farthest from the axis; smoothstep is steepest in its
  // middle, 3/2 of the mean. A circle counts as far as its center and its radius together.
  const double rate = 1.5 * 1.5 / 0.2;
  const Vec3 center(-0.3, 0, 0.3 - 0.04), pivot(-0.2, 0, 0.4), rim = center - Vec3(0.09, 0, 0);
  EXPECT_NEAR(expected_max_speed(scene), rate * ((center - pivot).norm() + 0.09), 1e-12);
  EXPECT_GE(expected_max_speed(scene), rate * (rim - pivot).norm());
  scene.fills.clear();
  EXPECT_GT(expected_max_speed(scene), rate * 0.1);
  scene.containers[0].tilt->keys = {{0.0, 0.0}};
  scene.containers[1].surface_velocity = Vec3(0.3, 0.4, 0);
  EXPECT_EQ(expected_max_speed(scene), 0.5);
}

}  // namespace
}  // namespace decant
