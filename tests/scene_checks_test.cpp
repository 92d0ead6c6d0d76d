/// \file
/// What a scene checks on itself, and the numbers it derives.
#include "reference/scene_checks.hpp"

#include "reference/distance.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/pose.hpp"
#include "reference/scene_file.hpp"
#include "reference/shapes.hpp"
#include "reference/sweep.hpp"
#include "tests/scene_folder.hpp"
#include "tests/special_values.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace decant {
namespace {

using test::scenes;

/// Two cups side by side, 9 mm apart, one pouring into the other; its numbers are used below.
Scene pour() {
  Scene s;
  s.name = "pour";
  s.particle_spacing = 0.00385;
  s.domain = {{-0.5, -0.5, -0.02}, {0.5, 0.5, 0.4}, {}};
  s.floor = Floor{0};
  const Tilt tilt{{-0.0385, 0, 0.129}, Vec3::UnitY(), {{0.2, 0}, {2.5, 7 * std::numbers::pi / 12}}};
  s.containers = {{"source", cup_shape(0.035, 0.09, 0.009), {-0.0735, 0, 0.039}, 0.009, tilt},
                  {"receiver", cup_shape(0.05, 0.07, 0.009), {0.0385, 0, 0.009}, 0.009, {}}};
  s.fills = {{"source", 0.069, {}}};
  s.schedule.end = 3.4;
  s.schedule.frames = 1000;
  s.schedule.substeps_per_frame = substeps_for(s);
  return s;
}

Scene channel() { return load_scene(scenes / "channel-periodic.json"); }
Scene dam() { return load_scene(scenes / "dam-break.json"); }

/// A cup or a peg, where a test needs one solid more.
Container cup_at(const Vec3& origin) { return {"third", cup_shape(0.02, 0.03, 0.009), origin, 0.009, {}}; }

/// A blade of 12 × 20 × 30 mm from `origin` on.
Container blade_at(const Vec3& origin) {
  const SolidBox box{Vec3::Zero(), Vec3(0.012, 0.02, 0.03)};
  return {"blade", BoxShape{box, {box}}, origin, 0.012, {}};
}

/// A sound scene made wrong: the refusal names `key`, and value and bound hold the texts.
struct Unsound {
  const char* what;
  std::function<Scene()> base;
  std::function<void(Scene&)> change;
  const char *key, *value, *bound;
};

void PrintTo(const Unsound& scene, std::ostream* out) { *out << scene.what; }

using test::nan;

const Unsound unsound[] = {
    {"SpacingNotANumber", pour, [](Scene& s) { s.particle_spacing = nan; }, "particle_spacing", "nan", "> 0"},
    {"SupportBelowOneAndAHalf", pour, [](Scene& s) { s.support_ratio = 1.4; }, "support_ratio", "1.4", ">= 1.5"},
    {"DomainBeyondSinglePrecision", pour, [](Scene& s) { s.domain.max.x() = 100; }, "domain", "100.0",
     "single precision"},
    {"PeriodBelowThreeSupports", channel, [](Scene& s) { s.domain.max.y() = 0.005; }, "domain.periodic", "y",
     "a period >= 3 H = 0.006"},
    {"TwoContainersOfOneName", pour, [](Scene& s) { s.containers[1].name = "source"; }, "containers[1].name", "source",
     "containers[0] has it already"},
    {"WallThinnerThanSupport", pour, [](Scene& s) { s.containers[1].wall_thickness = 0.007; },
     "containers[1].wall_thickness", "0.007", ">= H = 0.0077"},
    {"WallLayersLeaveTheSolid", pour, [](Scene& s) { s.wall_layers = 3; }, "containers[0].wall_thickness", "0.009",
     "wall_layers · dx = 0.01155"},
    {"TiltKeysOutOfOrder", pour, [](Scene& s) { s.containers[0].tilt->keys[1].time = 0.2; },
     "containers[0].tilt.keys[1].time", "0.2", "later than the key before it"},
    {"TiltAxisNoUnit", pour, [](Scene& s) { s.containers[0].tilt->axis *= 2; }, "containers[0].tilt.axis",
     "(0.0, 2.0, 0.0)", "a unit vector"},
    {"TiltPivotOutsideDomain", pour, [](Scene& s) { s.containers[0].tilt->pivot.x() = 3; }, "containers[0].tilt.pivot",
     "(3.0, 0.0, 0.129)", "a point in the domain"},
    {"TiltLeavesDomain", pour, [](Scene& s) { s.domain.min.x() = -0.16; }, "containers[0].tilt",
     "source reaches x = -0.165", ">= -0.16, the domain's end"},
    {"ContainerOutsideDomain", pour, [](Scene& s) { s.domain.max.x() = 0.09; }, "containers[1].origin",
     "receiver reaches x = 0.0975", "<= 0.09, the domain's end"},
    {"ContainerBelowFloor", pour, [](Scene& s) { s.floor->height = 0.001; }, "containers[1].origin",
     "receiver reaches z = 0.0", ">= 0.001, the floor's height"},
    {"TiltReachesBelowFloor", pour,
     [](Scene& s) {
       s.containers[0].tilt->pivot = s.containers[0].origin;
       s.domain.min.z() = -0.05;
     },
     "containers[0].tilt", "source reaches z = -0.02679", ">= 0.0, the floor's height"},
    {"CupsOverlapAtTheStart", pour, [](Scene& s) { s.containers[1].origin.x() -= 0.012; }, "containers[1]",
     "receiver and source overlap by 0.003 at t = ", "apart by >= H = 0.0077"},
    {"CupsWithinSupport", pour, [](Scene& s) { s.containers[1].origin.x() -= 0.0015; }, "containers[1]",
     "receiver and source are 0.0075", "apart by >= H = 0.0077"},
    {"CupsMeetDuringTheTilt", pour, [](Scene& s) { s.containers.push_back(cup_at({-0.16, 0, 0.15})); }, "containers[2]",
     "third and source overlap by", "at all times"},
    {"CupInsideTheSolidOfAnother", pour, [](Scene& s) { s.containers.push_back(cup_at({0.0385, 0, 0.02})); },
     "containers[2]", "third and receiver are 0.002", "apart by >= H"},
    {"TankShorterThanThePeriod", channel,
     [](Scene& s) { std::get<BoxShape>(s.containers[0].shape).solid[1].max.x() = 0.009; }, "containers[0]",
     "x from 0.0 to 0.009", "exactly the period, from 0.0 to 0.01"},
    {"TiltInAPeriodicDomain", channel,
     [](Scene& s) { s.containers[0].tilt = Tilt{Vec3::Zero(), Vec3::UnitX(), {{0, 0}, {1, 1}}}; }, "containers[0].tilt",
     "tilts", "the domain is periodic along x"},
    {"TranslationAlongThePeriodThatIsSpanned", channel,
     [](Scene& s) { s.containers[0].translation.emplace().velocity = {0, 0.1, 0}; }, "containers[0].translation",
     "along y", "spans the domain's period"},
    {"TranslationKeysOutOfOrder", pour,
     [](Scene& s) { s.containers[1].translation.emplace().keys = {{1, Vec3::Zero()}, {1, Vec3::Zero()}}; },
     "containers[1].translation.keys[1].time", "1.0", "later than the key before it"},
    {"TranslationThatIsNoNumber", pour,
     [](Scene& s) { s.containers[1].translation.emplace().keys[0].offset.y() = nan; },
     "containers[1].translation.keys[0]", "0.0", "finite numbers"},
    {"OscillationWithoutAFrequency", pour, [](Scene& s) { s.containers[0].tilt->oscillation = {0.01, 0}; },
     "containers[0].tilt.oscillation.frequency", "0.0", "> 0"},
    {"TranslationLeavesDomain", pour, [](Scene& s) { s.containers[1].translation.emplace().velocity = {0, 0.2, 0}; },
     // 59 mm of it lie in front, and 0.2 m/s · 3.4 s.
     "containers[1].translation", "receiver reaches y = 0.739", "<= 0.5, the domain's end"},
    {"SwayReachesBelowFloor", pour,
     [](Scene& s) { s.containers[1].translation.emplace().oscillation = {Vec3(0, 0, 0.001), 2}; },
     "containers[1].translation", "receiver reaches z = -0.001", ">= 0.0, the floor's height"},
    {"CupsMeetInASway", pour,
     [](Scene& s) { s.containers[1].translation.emplace().oscillation = {Vec3(0.002, 0, 0), 5}; }, "containers[1]",
     "receiver and source are 0.007", "apart by >= H = 0.0077"},
    {"MixerMeetsItsNeighborLateInItsTurn", pour,
     [](Scene& s) {
       // Round a line above it; it comes back to where it began from the other side.
       s.containers[0].tilt = Tilt{s.containers[0].origin + Vec3(0, 0, 0.12), Vec3::UnitY(), {{0, 0}}, 2};
     },
     "containers[1]", "receiver and source overlap by", "at all times"},
    {"PistonTheFluidCannotFollow", dam,
     [](Scene& s) {
       s.domain.min.x() = -1;
       s.containers[0].translation.emplace().keys = {{0, Vec3::Zero()}, {0.1, Vec3(-0.5, 0, 0)}};
     },
     // 3/2 of the mean speed, 5 m/s, at halfway.
     "fluid.sound_speed", "", "where the speed to expect is 7.65"},
    {"FillThroughABlade", dam, [](Scene& s) { s.containers.push_back(blade_at({0.02, 0.015, 0.03})); }, "fill[0]",
     "a particle at (", "a fill leaves room for what its `around` names"},
    {"FillAroundItsOwnContainer", dam, [](Scene& s) { s.fills[0].around = {"tank"}; }, "fill[0].around", "tank",
     "the name of another container"},
    {"FillAroundNothingKnown", dam, [](Scene& s) { s.fills[0].around = {"gate"}; }, "fill[0].around", "gate",
     "the name of another container"},
    {"FillAroundABladeThatHitsTheTank", dam,
     [](Scene& s) {
       s.containers.push_back(blade_at({0.02, 0.015, 0.03}));
       s.containers[1].translation.emplace().keys = {{0, Vec3::Zero()}, {0.1, Vec3(0, 0, -0.025)}};
       s.fills[0].around = {"blade"};
     },
     "containers[1]", "blade and tank", "at all times"},
    {"CupAtAPeriodicBoundary", pour,
     [](Scene& s) {
       s.containers[0].tilt.reset();
       s.domain.periodic[0] = true;
       s.domain.max.x() = 0.1;
     },
     "containers[1].origin", "receiver reaches x = 0.0975", "H inside the periodic boundary"},
    {"LevelAboveTheCup", pour, [](Scene& s) { s.fills[0].level = 0.091; }, "fill[0].level", "0.091",
     "<= 0.09, the inner height of source"},
    {"LevelAboveTheTank", channel, [](Scene& s) { s.fills[0].level = 0.021; }, "fill[0].level", "0.021",
     "<= 0.02, the inner height of plates"},
    {"BoxOutsideItsTank", dam, [](Scene& s) { s.fills[0].box->max.x() = 0.31; }, "fill[0].box", "x 0.0 to 0.31",
     "within the cavity of tank, x 0.0 to 0.3"},
    {"BoxThroughAnObstacle", dam,
     [](Scene& s) { std::get<BoxShape>(s.containers[0].shape).solid.push_back({{0.05, 0, 0}, {0.07, 0.05, 0.02}}); },
     "fill[0].box", "x 0.0 to 0.06", "where a box stands at x 0.05 to 0.07"},
    {"BoxCornersOutsideItsCup", pour,
     [](Scene& s) { s.fills[0].box = SolidBox{{-0.02, -0.03, 0}, {0.02, 0.03, 0.05}}; }, "fill[0].box",
     "x -0.02 to 0.02", "r <= 0.035"},
    {"BoxAboveItsCup", pour, [](Scene& s) { s.fills[0].box = SolidBox{{-0.02, -0.02, 0.05}, {0.02, 0.02, 0.1}}; },
     "fill[0].box", "z 0.05 to 0.1", "z from 0.0 to 0.09, the cavity of source"},
    {"FreeBoxOutsideDomain", pour,
     [](Scene& s) { s.fills.push_back({"", 0, SolidBox{{0.4, 0, 0}, {0.6, 0.1, 0.1}}, {}}); }, "fill[1].box",
     "x 0.4 to 0.6", "within the domain, x -0.5 to 0.5"},
    {"FreeBoxBelowFloor", pour,
     [](Scene& s) { s.fills.push_back({"", 0, SolidBox{{0.2, 0, -0.01}, {0.3, 0.1, 0.1}}, {}}); }, "fill[1].box.min[2]",
     "-0.01", ">= 0.0, the floor's height"},
    {"FreeBoxThroughACup", pour,
     [](Scene& s) { s.fills.push_back({"", 0, SolidBox{{0.02, 0, 0.05}, {0.12, 0.05, 0.1}}, {}}); }, "fill[1]",
     "a particle at (", "from every wall"},
    {"FreeBoxThroughATank", dam,
     [](Scene& s) { s.fills.push_back({"", 0, SolidBox{{0.2, 0, 0.1}, {0.31, 0.05, 0.2}}, {}}); }, "fill[1].box",
     "x 0.2 to 0.31", "clear of the walls of tank"},
    {"FillsThatOverlap", dam,
     [](Scene& s) { s.fills.push_back({"", 0, SolidBox{{0.05, 0, 0.1}, {0.2, 0.05, 0.2}}, {}}); }, "fill[1]",
     "from one of fill[0]", "fills that do not overlap"},
    {"FillWithoutRoomForAParticle", pour, [](Scene& s) { s.fills[0].level = 0.003; }, "fill[0]", "no particle",
     "room for at least one"},
    {"SoundSlowerThanFourTimesTheFall", pour, [](Scene& s) { s.fluid.sound_speed = 8; }, "fluid.sound_speed", "8.0",
     ">= 4 v_max = 8.33"},
    {"SubstepBeyondCfl", pour, [](Scene& s) { s.schedule.substeps_per_frame = 20; }, "time.substeps_per_frame", "20",
     "the CFL limit 0.4 h / (c0 + v_max)"},
    {"SubstepBeyondCflHoweverCourantAsks", pour, [](Scene& s) { s.schedule.courant = 0.5; }, "time.courant", "0.5",
     "(0, 0.4]"},
    {"SubstepBeyondTheViscousLimit", pour, [](Scene& s) { s.fluid.viscosity = 20; }, "time.substeps_per_frame", "27",
     "the viscous limit 0.125 h² rho0 / max(mu, mu_w / 2)"},
    {"NoSubsteps", pour, [](Scene& s) { s.schedule.substeps_per_frame = 0; }, "time.substeps_per_frame", "0",
     "at least 1"},
    {"GravityAlongAPeriodWithoutASpeed", channel, [](Scene& s) { s.schedule.max_speed.reset(); }, "time.max_speed",
     "missing", "gravity pulls along the periodic axis x"},
};

class UnsoundScene : public testing::TestWithParam<Unsound> {};

TEST_P(UnsoundScene, IsRefusedWithKeyValueAndBound) {
  const Unsound& wrong = GetParam();
  Scene scene = wrong.base();
  wrong.change(scene);
  try {
    check_scene(scene, "unsound.json");
    ADD_FAILURE() << "was not refused";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "unsound.json");
    EXPECT_EQ(error.key(), wrong.key);
    EXPECT_NE(error.value().find(wrong.value), std::string::npos) << error.what();
    EXPECT_NE(error.bound().find(wrong.bound), std::string::npos) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(SceneChecks, UnsoundScene, testing::ValuesIn(unsound),
                         [](const auto& scene) { return scene.param.what; });

TEST(SceneChecks, WarnsOfSlowSoundWithTheExpectedCompression) {
  const Scene scene = pour();
  const auto warnings = check_scene(scene, "pour");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("fluid.sound_speed = 10.0"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("compress by up to 4.3"), std::string::npos) << warnings[0];
}

TEST(SceneChecks, AcceptsACupStandingOnTheFloorAndNoLower) {
  Scene scene = pour();
  scene.floor->height = 0;
  EXPECT_NO_THROW(check_scene(scene, "pour"));
  scene.floor->height = 1e-4;
  EXPECT_THROW(check_scene(scene, "pour"), InputError);
}

TEST(SceneChecks, AcceptsFillsThatTouch) {
  Scene scene = dam();
  scene.fills.push_back({"tank", 0, SolidBox{{0.06, 0, 0}, {0.12, 0.05, 0.12}}, {}});
  EXPECT_NO_THROW(check_scene(scene, "dam"));
}

TEST(SceneChecks, ContainersASupportApartAreNotRefused) {
  Scene scene = pour();
  scene.containers[1].origin.x() = scene.containers[0].origin.x() + 0.044 + 0.059 + scene.support_radius();
  EXPECT_NO_THROW(check_scene(scene, "pour"));
}

TEST(ExpectedMaxSpeed, IsThatOfAFallFromTheHighestPointOfTheTilt) {
  const Scene scene = pour();
  // The far end of the cup's bottom is carried highest; the turn about the lip ends at 105°.
  const double angle = 105 * std::numbers::pi / 180;
  const double highest = 0.129 + 0.07 * std::sin(angle) - 0.09 * std::cos(angle);
  EXPECT_NEAR(expected_max_speed(scene), std::sqrt(2 * 9.81 * highest), 0.01);
}

TEST(ExpectedMaxSpeed, OfADamIsThatOfItsHeight) {
  EXPECT_DOUBLE_EQ(expected_max_speed(dam()), std::sqrt(2 * 9.81 * 0.12));
}

TEST(ExpectedMaxSpeed, CountsTheFirstVelocityAndYieldsToTheScene) {
  Scene scene = dam();
  scene.fills[0].velocity = {3, 0, 4};
  EXPECT_DOUBLE_EQ(expected_max_speed(scene), std::sqrt(25 + 2 * 9.81 * 0.12));
  scene.gravity.setZero();
  EXPECT_DOUBLE_EQ(expected_max_speed(scene), 5);
  // At the corner farthest along z: 12 m/s more of it.
  scene.fills[0].velocity_gradient(2, 2) = 100;
  EXPECT_DOUBLE_EQ(expected_max_speed(scene), std::hypot(3, 16));
  scene.fills[0].velocity_gradient.setZero();
  scene.containers[0].surface_velocity = {0, 7, 0};
  EXPECT_DOUBLE_EQ(expected_max_speed(scene), 7);
  scene.schedule.max_speed = 1.5;
  EXPECT_EQ(expected_max_speed(scene), 1.5);
}

TEST(SubstepsFor, AreTheFewestThatTheLimitsAllow) {
  for (const Scene& base : {pour(), channel(), dam()})
    for (double courant : {0.4, 0.25, 0.1}) {
      Scene scene = base;
      scene.schedule.courant = courant;
      const double longest = longest_time_step(scene, courant, expected_max_speed(scene));
      scene.schedule.substeps_per_frame = substeps_for(scene);
      EXPECT_LE(scene.time_step(), longest);
      EXPECT_NO_THROW(check_scene(scene, "s"));
      --scene.schedule.substeps_per_frame;
      EXPECT_GT(scene.time_step(), longest);
    }
}

TEST(WithParticles, ComesNearTheRequestAndStaysSound) {
  for (const std::int64_t request : {2000, 4000, 10000, 56000}) {
    const Scene scene = with_particles(pour(), request);
    EXPECT_NEAR(static_cast<double>(initial_state(scene).size()) / static_cast<double>(request), 1,
                request < 10000 ? 0.04 : 0.015)
        << request;
    EXPECT_EQ(scene.schedule.substeps_per_frame, substeps_for(scene));
    if (request >= 4000) {  // below, H is more than the cups' walls
      EXPECT_NO_THROW(check_scene(scene, "pour"));
    }
  }
}

TEST(WithParticles, KeepsSubstepsThatTheSceneSets) {
  Scene scene = pour();
  scene.schedule.substeps_derived = false;
  scene.schedule.substeps_per_frame = 40;
  EXPECT_EQ(with_particles(scene, 10000).schedule.substeps_per_frame, 40);
}

TEST(WithParticles, RefusesWhatIsNoNumberOfParticles) {
  EXPECT_THROW(with_particles(pour(), 0), InputError);
  EXPECT_THROW(with_particles(pour(), 2000000000), InputError);
}

TEST(ExpectedMaxSpeed, CountsWallsThatHoldNoFluid) {
  Scene scene = dam();
  scene.gravity.setZero();
  EXPECT_EQ(expected_max_speed(scene), 0);
  scene.containers.push_back(blade_at({0.2, 0.015, 0.06}));
  scene.containers[1].translation.emplace().oscillation = {Vec3(0, 0, 0.01), 3};
  EXPECT_DOUBLE_EQ(expected_max_speed(scene), 2 * std::numbers::pi * 3 * 0.01);
}

TEST(SceneChecks, AFillAroundABladeKeepsHalfASpacingFromIt) {
  Scene scene = dam();
  const auto whole = initial_state(scene).size();
  scene.containers.push_back(blade_at({0.02, 0.015, 0.03}));
  scene.fills[0].around = {"blade"};
  EXPECT_NO_THROW(check_scene(scene, "dam"));
  const ParticleState state = initial_state(scene);
  const SolidDistance solid(scene.containers[1]);
  const Pose pose = pose_at(scene.containers[1], 0);
  double nearest = 1;
  for (Eigen::Index i = 0; i < state.size(); ++i)
    nearest = std::min(nearest, solid.at(pose.to_local(state.position.col(i))).distance);
  EXPECT_GE(nearest, 0.4999 * scene.particle_spacing);
  EXPECT_LT(nearest, scene.particle_spacing);
  // What is missing fills the blade and half a spacing around it: 17 × 25 × 35 mm and a point a side.
  EXPECT_GE(whole - state.size(), 2 * 4 * 6);
  EXPECT_LE(whole - state.size(), 5 * 7 * 9);
}

TEST(CavityRadius, OfACupIsItsInnerRadiusAboveTheBottomAndZeroInIt) {
  const RevolvedShape cup = cup_shape(0.03, 0.05, 0.009);
  EXPECT_DOUBLE_EQ(cavity_radius(cup, 0.02), 0.03);
  EXPECT_EQ(cavity_radius(cup, -0.004), 0);
  EXPECT_TRUE(std::isinf(cavity_radius(cup, 0.06)));
  EXPECT_DOUBLE_EQ(cavity_radius(cup, 0.0, 0.05).least, 0.03);
  EXPECT_DOUBLE_EQ(cavity_radius(cup, 0.0, 0.05).greatest, 0.03);
  EXPECT_DOUBLE_EQ(rim_height(cup), 0.05);
  EXPECT_DOUBLE_EQ(cavity_bottom(cup), 0.0);
}

}  // namespace
}  // namespace decant
