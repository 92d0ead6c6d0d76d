/// \file
/// Lists that are kept while particles move: made for the places where particles are going to be, they
/// serve twice as long and still miss nothing. And what a particle's distance from the walls spares.
#include "oracle/files/fixture_file.hpp"
#include "tests/backend_variants.hpp"
#include "tests/falling_points.hpp"
#include "tests/random_scene.hpp"

#include "oracle/solution/reference_backend.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

namespace decant {
namespace {

class KeptList : public testing::TestWithParam<Executor> {
 protected:
  void SetUp() override {
    std::string why_not;
    if (!executor_available(GetParam(), &why_not)) GTEST_SKIP() << why_not;
  }
  static std::unique_ptr<Backend> make(const std::string& name) { return test::make_variant(name, GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(On, KeptList, testing::Values(Executor::host, Executor::cuda), test::executor_name);

/// A cloud that falls in on itself, in one run. What lists that were too short spoiled must not show.
TEST_P(KeptList, ThatOverflowsInARunLeavesTheBitsThatAmpleRoomLeaves) {
  const Fixture f = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-gathering.h5");
  const auto run = [&](const std::string& name) {
    const auto backend = make(name);
    backend->load(f.scene, sample_walls(f.scene), f.state);
    const auto bytes = backend->neighbor_stats().device_bytes;
    EXPECT_TRUE(backend->advance(24).ok()) << name;
    ParticleState end;
    backend->read(end);
    return std::pair(end, backend->neighbor_stats().device_bytes - bytes);
  };
  for (const std::string name : {"hash", "list"}) {
    const auto [tight, grown] = run(name);
    const auto [ample, grown_too] = run(name + ":capacity=400");
    EXPECT_GT(grown, grown_too) << name;
    EXPECT_TRUE(tight.position == ample.position) << name;
    EXPECT_TRUE(tight.velocity == ample.velocity) << name;
  }
}

/// A run from the same scene, loaded again, has the room that the first one found; another scene starts afresh.
TEST_P(KeptList, KeepsItsRoomForTheSameSceneAlone) {
  const Fixture gathering = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-gathering.h5");
  const Fixture other = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-crowd.h5");
  for (const std::string name : {"hash", "list"}) {
    const auto backend = make(name);
    const auto loaded = [&](const Fixture& f) {
      backend->load(f.scene, sample_walls(f.scene), f.state);
      return backend->neighbor_stats().device_bytes;
    };
    const auto first = loaded(gathering);
    EXPECT_TRUE(backend->advance(24).ok()) << name;
    const auto grown = backend->neighbor_stats().device_bytes;
    EXPECT_GT(grown, first) << name;
    EXPECT_EQ(loaded(gathering), grown) << name;
    loaded(other);
    const auto afresh = loaded(gathering);
    EXPECT_TRUE(backend->advance(24).ok()) << name;
    EXPECT_GT(backend->neighbor_stats().device_bytes, afresh) << name;
  }
}

/// Points a lattice spacing apart that fly the same way, in the open, with nothing that pulls at them.
Fixture flight(const Vec3& velocity) {
  Fixture f = test::random_fixture(3);
  const double dx = f.scene.particle_spacing;
  f.scene.containers.clear();
  f.scene.gravity.setZero();
  f.scene.domain = {Vec3::Constant(-1), Vec3::Constant(1), {}};
  f.state.position.resize(3, 512);
  for (int i = 0; i < 512; ++i)
    f.state.position.col(i) = 3 * dx * Vec3(i % 8, i / 8 % 8, i / 64);  // nobody's neighbors
  f.state.velocity = velocity.replicate(1, 512);
  f.state.quantise();
  return f;
}

std::int64_t rebuilds_of(Backend& backend, const Fixture& f, int substeps) {
  backend.load(f.scene, sample_walls(f.scene), f.state);
  EXPECT_TRUE(backend.advance(substeps).ok());
  return backend.neighbor_stats().rebuilds;
}

TEST_P(KeptList, ServesUntilItsParticlesAreAsFarPastTheirPlacesAsTheyWereBefore) {
  // A way of 0.02 H a substep and a skin of 0.2 H: away from where they are particles may go for five
  // substeps; to places ahead and past them as far again, for nine, a twelfth being kept for speeds that
  // grow.
  Fixture f = flight(Vec3::Zero());
  const double v = 0.02 * f.scene.support_radius() / f.scene.time_step();
  f = flight(Vec3(v, 0, 0));
  for (const char* launch : {"auto", "graphs", "plain"}) {
    const auto list = make(std::string("list:skin=0.2:launch=") + launch);
    EXPECT_LE(rebuilds_of(*list, f, 90), 10) << launch;
    EXPECT_GE(rebuilds_of(*list, f, 90), 9) << launch;
  }
}

/// A cup of water that turns faster than the water falls.
Scene fast_cup() {
  Scene scene = test::falling_points_scene();
  scene.gravity.setZero();
  scene.containers[0].tilt->keys = {{0.0, 0.0}, {0.02, 1.0}};
  Fill water;
  water.container = "source";
  water.level = 0.06;
  scene.fills = {water};
  return scene;
}

TEST_P(KeptList, GivesTheSameHoweverSubstepsAreLaunched) {
  const auto expect_same = [&](const Scene& scene, const ParticleState& start, int substeps) {
    const Walls walls = sample_walls(scene);
    const auto run = [&](const std::string& launch) {
      const auto list = make("list:tiles=off:launch=" + launch);  // in tiles sums have another order
      list->load(scene, walls, start);
      const Status status = list->advance(substeps);
      ParticleState end;
      list->read(end);
      return std::pair(end, status.bits);
    };
    const auto [at_once, bits] = run("auto");
    for (const char* launch : {"graphs", "plain"}) {
      const auto [one_by_one, its_bits] = run(launch);
      EXPECT_EQ(bits, its_bits) << scene.name << " " << launch;
      EXPECT_TRUE(at_once.position == one_by_one.position) << scene.name << " " << launch;
      EXPECT_TRUE(at_once.velocity == one_by_one.velocity) << scene.name << " " << launch;
    }
  };
  const Fixture pour = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-splash.h5");
  expect_same(pour.scene, pour.state, pour.scene.schedule.substeps_per_frame);
  const Fixture periodic = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-periodic.h5");
  expect_same(periodic.scene, periodic.state, 30);
  const Scene cup = fast_cup();
  expect_same(cup, initial_state(cup), 60);
}

TEST_P(KeptList, OfParticlesThatStartToFallIsMadeAnewInTime) {
  // From rest they fall 0.1 H in nine substeps and 2 H in forty; a list has 0.2 H of it at most, and a
  // substep that leads to the next.
  Fixture f = flight(Vec3::Zero());
  const double H = f.scene.support_radius(), dt = f.scene.time_step();
  f.scene.gravity = Vec3(-0.2 * H / (81 * dt * dt), 0, 0);
  const auto list = make("list:skin=0.2");
  EXPECT_GE(rebuilds_of(*list, f, 40), 8);
}

TEST_P(KeptList, MissesNoPairOfRandomScenes) {
  std::int64_t pairs = 0;
  for (const char* name :
       {"list:check_completeness=on", "list:check_completeness=on:skin=0.05",
        "list:check_completeness=on:criterion=relative", "list:check_completeness=on:build=all-pairs"})
    for (std::uint32_t seed = 100; seed < 112; ++seed) {
      const Fixture f = test::random_fixture(seed);
      const auto list = make(name);
      list->load(f.scene, sample_walls(f.scene), f.state);
      for (int k = 0; k < 3; ++k) {
        const Status status = list->advance(12);
        EXPECT_EQ(status.bits & Status::missed_pair, 0u) << name << " " << seed << ": " << describe(status);
        if (!status.ok()) break;
      }
      const PairTotals found = list->neighbor_stats().verified;
      EXPECT_EQ(found.missed + found.wall_missed, 0) << name << " " << seed;
      pairs += found.pairs + found.wall_pairs;
    }
  EXPECT_GT(pairs, 1'000'000);
}

TEST_P(KeptList, MissesNoPairWhereTheWallsAreFasterThanTheFluid) {
  const Scene scene = fast_cup();
  const Walls walls = sample_walls(scene);
  for (const char* name : {"list:check_completeness=on", "list:check_completeness=on:criterion=relative"}) {
    const auto list = make(name);
    list->load(scene, walls, initial_state(scene));
    for (int k = 0; k < 10; ++k) ASSERT_EQ(list->advance(10).bits & Status::missed_pair, 0u) << name;
    EXPECT_GT(list->neighbor_stats().verified.wall_pairs, 5'000) << name;
    EXPECT_EQ(list->neighbor_stats().verified.wall_missed, 0) << name;
  }
}

TEST_P(KeptList, MissesNoPairOfAPistonThatComesUponFluidAtRest) {
  // From two supports away, at up to a fifth of the speed of sound, and half through.
  Scene scene = load_scene(DECANT_SOURCE_DIR "/fixtures/scenes/motion-piston.json");
  scene.gravity.setZero();
  scene.fills[0].around.clear();
  scene.fills[0].box = SolidBox{Vec3(0.1, 0, 0), Vec3(0.2, 0.06, 0.06)};
  Translation& stroke = *scene.containers[1].translation;
  stroke.keys = {{0, Vec3::Zero()}, {0.06, Vec3(0.1, 0, 0)}};
  stroke.oscillation.reset();
  scene.schedule.substeps_per_frame = substeps_for(scene);
  check_scene(scene, scene.name);
  const Walls walls = sample_walls(scene);
  for (const char* name : {"list:check_completeness=on", "list:check_completeness=on:skin=0.2",
                           "list:check_completeness=on:criterion=relative"}) {
    const auto list = make(name);
    list->load(scene, walls, initial_state(scene));
    for (int k = 0; k < 20; ++k) ASSERT_EQ(list->advance(8).bits & Status::missed_pair, 0u) << name;
    EXPECT_GT(list->neighbor_stats().verified.wall_pairs, 5'000) << name;
    EXPECT_EQ(list->neighbor_stats().verified.wall_missed, 0) << name;
    // Lists are kept for some substeps, or there would be nothing to see.
    EXPECT_LT(list->neighbor_stats().rebuilds, 140) << name;
  }
}

TEST_P(KeptList, IsBuiltAnewBecauseThePistonMovesWhateverTheFluidDoes) {
  // A wall that goes 0.02 H a substep, far from fluid that rests: a skin of 0.2 H lasts five substeps.
  Fixture f = flight(Vec3::Zero());
  const double H = f.scene.support_radius(), v = 0.02 * H / f.scene.time_step();
  f.scene.containers.push_back({"piston", tank_shape(Vec3::Constant(H), 2 * H, {}), Vec3::Constant(-0.5), 2 * H, {}});
  f.scene.containers[0].translation.emplace().velocity = Vec3(v, 0, 0);
  const auto list = make("list:skin=0.2");
  EXPECT_GE(rebuilds_of(*list, f, 90), 90 / 6);
}

/// What is loaded anew knows nothing of its distance from the walls and looks for them.
TEST_P(KeptList, WallsThatAreNotLookedForWouldNotHaveTouched) {
  int compared = 0;
  const auto expect_same = [&](const char* name, const Scene& scene, const ParticleState& start, int substeps) {
    const Walls walls = sample_walls(scene);
    const auto once = make(name), again = make(name);
    once->load(scene, walls, start);
    ParticleState one, other = start;
    for (int k = 0; k < substeps; ++k) {
      again->load(scene, walls, other);
      const bool runs = once->advance(1).ok();
      ASSERT_EQ(again->advance(1).ok(), runs) << scene.name << ", substep " << k;
      if (!runs) return;
      ++compared;
      again->read(other);
      once->read(one);
      ASSERT_TRUE(one.position == other.position && one.velocity == other.velocity) << scene.name << ", substep " << k;
    }
  };
  for (std::uint32_t seed = 200; seed < 212; ++seed) {
    const Fixture f = test::random_fixture(seed);
    expect_same("brute", f.scene, f.state, 20);
  }
  // Into the receiver, out of which it jumps, and out of the source's way.
  Scene scene = test::falling_points_scene();
  scene.contact.restitution = 0.9;
  ParticleState start = initial_state(scene);
  start.velocity.row(2).setConstant(-3);
  start.quantise();
  expect_same("brute", scene, start, 150);
  // Water in a cup that tilts. A hash gives the same bits whatever order particles come in.
  for (const char* phase : {"tilt-onset", "stream", "splash"}) {
    const Fixture f = read_fixture(std::string(DECANT_SOURCE_DIR "/fixtures/pour-4k-") + phase + ".h5");
    expect_same("hash", f.scene, f.state, 60);
  }
  EXPECT_GT(compared, 300);
}

}  // namespace
}  // namespace decant
