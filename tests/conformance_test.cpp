/// \file
/// Recorded fixtures are still what the reference says, and backends conform on them and on random
/// scenes nobody chose.
#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/lists/stale_list.hpp"
#include "tests/backend_variants.hpp"
#include "tests/random_scene.hpp"

#include "gpu/backends.hpp"
#include "oracle/solution/reference_backend.hpp"
#include "reference/distance.hpp"
#include "reference/error.hpp"
#include "reference/pose.hpp"
#include "tools/commands/fixture_folder.hpp"

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>
#include <random>
#include <string>
#include <vector>

namespace decant {
namespace {

/// Every row that did not pass, in words; empty where all did.
std::string objections(Backend& backend, const Fixture& fixture, const PreparedReference& oracle,
                       const CheckSelection& checks) {
  std::string all;
  for (const CheckRow& row : run_checks(backend, fixture, oracle, checks))
    if (verdict_of(row) != Verdict::pass)
      all += row.check + " " + row.field + ": score " + std::to_string(row.score) + " at " +
             std::to_string(row.worst_id) + " " + row.reason + "\n";
  return all;
}

std::string objections(Backend& backend, const Fixture& fixture) {
  const CheckSelection checks{"fields", "substep"};
  return objections(backend, fixture, *std::make_unique<PreparedReference>(prepare_reference(fixture, checks)), checks);
}

/// A fixture of the state with the oracle's answer, as `record` makes it.
Fixture answered(Fixture fixture) {
  evaluate_oracle(fixture.scene, fixture.state, fixture.fields.emplace(), fixture.condition.emplace());
  return fixture;
}

TEST(Fixtures, AreReproducedByTheReferenceOfToday) {
  const auto files = fixtures_in(fixture_folder(), false);
  EXPECT_GE(files.size(), 6u);
  for (const auto& file : files) EXPECT_NO_THROW(prepare_reference(read_fixture(file), {"fields"})) << file;
}

TEST(Fixtures, AreRefusedWhereTheReferenceSaysOtherwise) {
  Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-rest.h5");
  fixture.fields->density[100] *= 1 + 1e-13;
  try {
    prepare_reference(fixture);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.key(), "density[100]");
  }
}

TEST(Fixtures, AreJudgedTheSameByAllPairsAsByCells) {
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-splash.h5");
  const auto backend = make_reference_backend(NeighborSearch::all_pairs);
  EXPECT_EQ(objections(*backend, fixture), "");
}

class Conformance : public testing::TestWithParam<test::Variant> {
 protected:
  std::unique_ptr<Backend> backend() { return test::make_variant(GetParam()); }
  void SetUp() override {
    std::string why_not;
    if (!executor_available(GetParam().executor, &why_not)) GTEST_SKIP() << why_not;
  }
};

TEST_P(Conformance, HoldsOnEverySmallFixture) {
  const auto tested = backend();
  for (const auto& file : fixtures_in(fixture_folder(), false))
    EXPECT_EQ(objections(*tested, read_fixture(file)), "") << file;
}

TEST_P(Conformance, HoldsInEveryCheck) {
  // Rebuilt every so many substeps, whatever moves, a list misses pairs in a run.
  const bool may_miss = GetParam().name.find("rebuild=") != std::string::npos;
  CheckSelection checks = all_checks();
  if (may_miss) checks.erase("trajectory");
  static const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-splash.h5");
  static const PreparedReference oracle = prepare_reference(fixture);
  const auto tested = backend();
  EXPECT_EQ(objections(*tested, fixture, oracle, checks), "");
}

TEST_P(Conformance, HoldsOnRandomScenes) {
  const auto tested = backend();
  if (GetParam().name.find(':') != std::string::npos) {
    for (std::uint32_t seed = 1; seed <= 6; ++seed)
      EXPECT_EQ(objections(*tested, answered(test::random_fixture(seed))), "") << seed;
    return;
  }
  rc::detail::checkGTest([&](std::uint32_t seed) {
    const Fixture fixture = answered(test::random_fixture(seed));
    const std::string found = objections(*tested, fixture);
    RC_LOG() << found;
    RC_ASSERT(found.empty());
  });
}

/// Of 10,000 random scenes the one in which a particle's only wall particle stands at H to the last bit:
/// the oracle has no term, fp32 a tiny one, and both are right.
TEST_P(Conformance, HoldsWhereTheOnlyNeighborIsAtTheEdge) {
  EXPECT_EQ(objections(*backend(), answered(test::random_fixture(1332))), "");
}

/// Particles at rest all around the containers of a recording, inside and outside, near enough to their
/// walls to have neighbors there: where no pour leads many.
Fixture around_walls(const char* recording, std::uint32_t seed) {
  Fixture f = read_fixture(std::string(DECANT_SOURCE_DIR "/fixtures/") + recording);
  f.name = "around-" + f.name;
  std::mt19937 random(seed);
  const double dx = f.scene.particle_spacing, H = f.scene.support_radius();
  const double time = f.scene.time_at(f.state.substep);
  std::vector<Vec3> kept;
  for (const Container& container : f.scene.containers) {
    const SolidDistance solid(container);
    const Pose pose = pose_at(container, time);
    const auto real = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int found = 0; found < 400;) {
      const Vec3 local(real(-0.08, 0.08), real(-0.08, 0.08), real(-0.03, 0.13));
      const double distance = solid.at(local).distance;
      const Vec3 x = pose.rotation * local + pose.translation;
      if (!(distance > 0.3 * dx && distance < H) || x.z() < dx) continue;
      ++found;
      kept.push_back(x);
    }
  }
  f.state.position.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i) f.state.position.col(static_cast<Eigen::Index>(i)) = kept[i];
  f.state.velocity.setZero(3, f.state.position.cols());
  f.state.quantise();
  return f;
}

TEST_P(Conformance, HoldsAllAroundTheWalls) {
  const auto tested = backend();
  for (const char* recording : {"pour-4k-settled.h5", "pour-4k-stream.h5"})
    EXPECT_EQ(objections(*tested, answered(around_walls(recording, 1))), "") << recording;
}

/// What a list that verifies itself counts in some substeps. The status tells of promises not kept.
PairTotals counted(const std::string& variant, const Fixture& fixture, int substeps, Status* status = nullptr) {
  const auto list = test::make_variant(variant + ":check_completeness=on", Executor::host);
  list->load(fixture.scene, sample_walls(fixture.scene), fixture.state);
  const Status seen = list->advance(substeps);
  if (status) *status = seen;
  return list->neighbor_stats().verified;
}

TEST(Lists, MissNothingWhileTheyAreWatchedAndMuchWhileTheyAreNot) {
  constexpr int substeps = 40;
  const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-splash.h5");
  for (const char* watched :
       {"list", "list:criterion=relative:skin=0.05", "list:build=all-pairs:skin=0.1", "list:skin=0.4"}) {
    Status status;
    const PairTotals all = counted(watched, fixture, substeps, &status);
    EXPECT_TRUE(status.ok()) << watched << ": " << describe(status);
    EXPECT_GT(all.pairs, 40 * 4000 * 20) << watched;
    EXPECT_EQ(all.missed + all.wall_missed, 0) << watched;
  }
  const PairTotals stale = counted("list:rebuild=40:skin=0", fixture, substeps);
  EXPECT_GT(stale.missed, stale.pairs / 100);
  EXPECT_GT(stale.wall_missed, stale.wall_pairs / 100);
}

TEST(Lists, VerifiedCountWhatTheOracleCounts) {
  for (const std::uint32_t seed : {2u, 3u, 5u, 8u}) {
    const Fixture f = test::random_fixture(seed);
    const Walls walls = sample_walls(f.scene);
    const WallSolution volumes = wall_solution(f.scene, walls);
    const StaleList built(f.scene, volumes.volume, instant_of(f.scene, walls, volumes, f.state), 0);
    PairTotals expected;
    for (int age = 0; age < 6; ++age) {
      const auto list = test::make_variant("list:rebuild=6:skin=0", Executor::host);
      list->load(f.scene, walls, f.state);
      ASSERT_TRUE(list->advance(age).ok());
      ParticleState state;
      list->read(state);
      const Staleness s = built.at(instant_of(f.scene, walls, volumes, state));
      expected.pairs += s.fluid.within;
      expected.missed += s.fluid.missed;
      expected.wall_pairs += s.wall.within;
      expected.wall_missed += s.wall.missed;
    }
    const PairTotals got = counted("list:rebuild=6:skin=0", f, 6);
    // fp32 may see a pair on the other side of H, from either end.
    EXPECT_NEAR(got.pairs, expected.pairs, 4) << seed;
    EXPECT_NEAR(got.missed, expected.missed, 4) << seed;
    EXPECT_NEAR(got.wall_pairs, expected.wall_pairs, 4) << seed;
    EXPECT_NEAR(got.wall_missed, expected.wall_missed, 4) << seed;
    EXPECT_GT(got.missed, 20) << seed;
  }
}

TEST(Lists, MissNothingInRandomScenes) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const Fixture f = test::random_fixture(seed);
    Status status;
    const PairTotals all = counted(seed % 2 ? "list" : "list:criterion=relative:skin=0.1", f, 12, &status);
    EXPECT_EQ(status.bits & Status::missed_pair, 0u) << seed << ": " << describe(status);
    EXPECT_EQ(all.missed + all.wall_missed, 0) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Backends, Conformance, testing::ValuesIn(test::backend_variants()), test::variant_name);

}  // namespace
}  // namespace decant
