/// \file
/// The sweep over intervals and skins, on recorded pours and a small budget.
#include "tools/drift/drift.hpp"
#include "oracle/files/fixture_file.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "tests/falling_points.hpp"
#include "tests/python.hpp"
#include "tests/random_scene.hpp"
#include "tools/commands/backend_choice.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace decant {
namespace {

std::unique_ptr<Backend> list_on_host(const drift::ListChoice& list, bool counting) {
  const std::string options = list.options();
  return choose_backend("list" + (options.empty() ? "" : ":" + options) + (counting ? ":check_completeness=on" : ""),
                        "host");
}

Fixture recorded(const std::string& phase) {
  return read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-" + phase + ".h5");
}

const Fixture& splash() {
  static const Fixture fixture = recorded("splash");
  return fixture;
}

drift::Plan plan_of(const std::vector<int>& intervals, const std::vector<double>& skins, int window, bool timed) {
  return {drift::all_lists(intervals, skins), true, window, timed};
}

const drift::Result& measured() {
  static const drift::Result result = drift::measure(splash(), plan_of({1, 4, 12}, {0, 0.4}, 12, true), list_on_host);
  return result;
}

const drift::Row& row(int interval, double skin) {
  for (const drift::Row& r : measured().rows)
    if (r.list.interval == interval && (interval == 0 || r.list.skin == skin)) return r;
  throw std::out_of_range("no such row");
}

TEST(Drift, AFreshListMissesNothingAndRunsAsTheAdaptiveOneDoes) {
  for (const double skin : {0.0, 0.4}) {
    EXPECT_EQ(row(1, skin).worst_missed_share, 0) << skin;
    EXPECT_EQ(row(1, skin).acceleration_score, 0) << skin;
    EXPECT_EQ(row(1, skin).first_miss, 1) << skin;
    EXPECT_LT(row(1, skin).deviation_over_ensemble, 3) << skin;
  }
}

TEST(Drift, GrowsWithTheIntervalAndShrinksWithTheSkin) {
  EXPECT_GT(row(4, 0).missed_share, 0);
  EXPECT_GT(row(12, 0).worst_missed_share, row(4, 0).worst_missed_share);
  EXPECT_GT(row(12, 0).acceleration_rms, row(4, 0).acceleration_rms);
  EXPECT_LT(row(12, 0.4).worst_missed_share, row(12, 0).worst_missed_share);
  EXPECT_GT(row(12, 0.4).wasted_share, row(12, 0).wasted_share);
  EXPECT_GT(row(12, 0).acceleration_score, 1);  // fp32 would not do that
}

TEST(Drift, NothingIsMissedBeforeDisplacementsAllowIt) {
  for (const drift::Row& r : measured().rows) EXPECT_LE(r.proved_until, r.first_miss) << r.list.interval;
  for (const drift::SafeInterval& safe : measured().safe) {
    EXPECT_GE(safe.measured, 1);
    EXPECT_LE(safe.proved, safe.measured);
    EXPECT_LE(safe.expected, safe.expected_relative);
    // Speeds change little within twelve substeps.
    EXPECT_NEAR(safe.expected, safe.proved, 1);
  }
}

TEST(Drift, OfOneListIsTheSameWhateverElseIsMeasured) {
  const drift::Result alone = drift::measure(splash(), plan_of({4}, {0}, 12, false), list_on_host);
  EXPECT_EQ(alone.rows[0].missed_share, row(4, 0).missed_share);
  EXPECT_EQ(alone.rows[0].acceleration_rms, row(4, 0).acceleration_rms);
  EXPECT_EQ(alone.samples.size(), 12u);
}

TEST(Drift, TimesAndFollowsEveryList) {
  EXPECT_EQ(measured().rows.size(), 7u);
  for (const drift::Row& r : measured().rows) {
    EXPECT_GT(r.substep_us, 0);
    EXPECT_GE(r.deviation, 0);
    EXPECT_GE(r.momentum_drift, 0);
  }
  EXPECT_EQ(row(12, 0).rebuild_every, 12);
  EXPECT_GT(row(12, 0).deviation, row(1, 0).deviation);
}

TEST(Drift, TheSkinThatTheoryAsksForKeepsTheTolerance) {
  for (const char* phase : {"splash", "filling"}) {
    const Fixture fixture = recorded(phase);
    for (const double tolerance : {1e-2, 1e-4}) {
      drift::Plan plan{drift::derived_lists({fixture}, {10}, tolerance), true, 20, false};
      ASSERT_EQ(plan.lists.size(), 1u);
      const double skin = plan.lists[0].skin;
      EXPECT_LT(skin, 0.5);
      plan.lists.push_back({10, 0, false});
      const drift::Result result = drift::measure(fixture, plan, list_on_host);
      // Theory knows the window's first state only.
      EXPECT_LT(result.rows[0].acceleration_rms, 2 * tolerance) << phase << " " << tolerance;
      // Nor does it ask for much more than is needed.
      EXPECT_GT(result.rows[1].acceleration_rms, skin > 0 ? tolerance / 4 : 0) << phase << " " << tolerance;
    }
  }
}

TEST(Drift, RecommendsWhatIsWithinTheTolerance) {
  std::vector<drift::Result> made(1);
  const auto add = [&](int interval, double skin, double error, double us) {
    drift::Row r;
    r.list = {interval, skin, false};
    r.acceleration_rms = error;
    r.substep_us = us;
    made[0].rows.push_back(r);
  };
  add(1, 0, 0, 90);
  add(10, 0, 1e-2, 40);
  add(10, 0.2, 1e-5, 50);
  add(0, NAN, 0, 60);
  EXPECT_EQ(drift::recommend(made, 1e-1)->substep_us, 40);
  EXPECT_EQ(drift::recommend(made, 2e-2)->substep_us, 40);
  EXPECT_EQ(drift::recommend(made, 1.9e-2)->substep_us, 50);  // half the tolerance is kept back
  EXPECT_EQ(drift::recommend(made, 1e-3)->list.skin, 0.2);
  EXPECT_EQ(drift::recommend(made, 1e-3)->adaptive_us, 60);
  EXPECT_EQ(drift::recommend(made, 1e-3)->next_error, 1e-2);
  EXPECT_EQ(drift::recommend(made, 1e-7)->list.interval, 0);
  // What is good in one phase has to be good in all of them.
  made.push_back(made[0]);
  made[1].rows[2].acceleration_rms = 1e-2;
  EXPECT_EQ(drift::recommend(made, 1e-3)->list.interval, 0);
  made[1].rows[3].acceleration_rms = NAN;
  EXPECT_EQ(drift::recommend(made, 1e-3)->list.interval, 1);
  std::swap(made[0], made[1]);
  EXPECT_EQ(drift::recommend(made, 1e-3)->list.interval, 1);
  EXPECT_EQ(drift::recommend({}, 1), nullptr);
}

TEST(Drift, HoldsOnStatesThatTheRecommendationHasNotSeen) {
  constexpr double tolerance = 1e-2;
  std::vector<drift::Result> seen;
  for (const char* phase : {"splash", "filling"}) {
    seen.push_back(drift::measure(recorded(phase), plan_of({1, 5, 10}, {0, 0.1, 0.2}, 12, false), list_on_host));
    // Times as they are on a GPU: a rebuild costs as much as two substeps.
    for (drift::Row& r : seen.back().rows) r.substep_us = 10 + 20.0 / r.list.interval + 20 * r.list.skin;
    drift::Row adaptive;
    adaptive.list = {0, drift::not_measured, false};
    adaptive.substep_us = 25;
    seen.back().rows.push_back(adaptive);
  }
  const auto best = drift::recommend(seen, tolerance);
  ASSERT_NE(best, nullptr);
  EXPECT_GT(best->list.interval, 1);
  for (const char* phase : {"tilt-onset", "stream", "dense-walls-stream", "rest"}) {
    const drift::Result unseen = drift::measure(recorded(phase), {{best->list}, true, 20, false}, list_on_host);
    EXPECT_LE(unseen.rows[0].acceleration_rms, tolerance) << phase;
  }
}

TEST(Drift, AlongAPourLooksJustBeforeEachRebuildAndPassesThePhases) {
  Scene scene = test::falling_points_scene(10);
  std::vector<Fixture> phases(2);
  phases[0].state.substep = 31;
  phases[1].state.substep = 7;
  test::FallingPoints points;
  const drift::PourResult pour = drift::along_pour(
      scene, plan_of({1, 6}, {0}, 10, false), 5,
      [](const drift::ListChoice&, bool) { return std::make_unique<test::FallingPoints>(); }, phases);
  ASSERT_EQ(pour.moments.size(), 10u);
  for (std::size_t k = 0; k < 10; ++k) {
    EXPECT_EQ(pour.moments[k].sample.stale.age, k % 2 ? 5 : 0);
    EXPECT_NEAR(pour.moments[k].time, 0.06 * static_cast<double>(k / 2), 1e-12);
  }
  EXPECT_EQ(phases[0].state.substep, 31);
  EXPECT_EQ(phases[1].state.substep, 7);
  EXPECT_EQ(phases[1].state.size(), 180);
}

TEST(Drift, OfWholePoursIsNothingForTheSameListAndSomethingForAnother) {
  Scene scene = test::falling_points_scene(40);
  int made = 0;
  int parts = 0;
  std::vector<drift::WholePour> pours;
  drift::whole_pours(
      scene, plan_of({5}, {0}, 10, false), 2,
      [&](const drift::ListChoice& list, bool) {
        auto backend = std::make_unique<test::FallingPoints>();
        if (list.interval == 5) backend->trouble_at = 150;
        ++made;
        return backend;
      },
      [&](const std::function<void()>& part) {
        // What is done is there before the next is begun.
        EXPECT_EQ(static_cast<int>(pours.size()), parts++);
        part();
      },
      pours);
  ASSERT_EQ(pours.size(), 4u);
  EXPECT_EQ(made, 4);
  EXPECT_EQ(pours[0].energy_drift, 0);
  EXPECT_EQ(pours[0].momentum_drift, 0);
  EXPECT_GT(pours[1].momentum_drift, 0);
  EXPECT_NE(pours[1].momentum_drift, pours[2].momentum_drift);
  EXPECT_NE(pours[3].trouble.find("particle 3"), std::string::npos);
  EXPECT_TRUE(std::isnan(pours[3].energy_drift));
  double all = 0;
  for (const double share : pours[0].share_at) all += share;
  EXPECT_NEAR(all, 1, 1e-12);
}

TEST(Drift, ReportIsAsDocumented) {
  if (!test::python_has("h5py")) GTEST_SKIP() << "no h5py in " << test::python();
  const TemporaryFolder folder;
  const auto file = folder / "drift.h5";
  drift::PourResult pour{"scene", {{0.5, measured().samples[3]}}, {drift::WholePour{}}};
  for (const auto& pours : {std::vector<drift::PourResult>{}, std::vector{pour}}) {
    drift::write(file, {measured()}, pours, {"list", "", "host", "here", "fp32"});
    EXPECT_EQ(test::run_python({DECANT_SOURCE_DIR "/tools/python/check_schema.py", file.string()}), 0);
  }
  const std::string table = drift::table({measured()});
  EXPECT_NE(table.find("safe interval"), std::string::npos);
}

/// A series that holds our own lists of a random fixture whose particles move.
class Series : public testing::Test {
 protected:
  Series()
      : fixture_(test::random_fixture(4)),
        walls_(sample_walls(fixture_.scene)),
        volumes_(wall_solution(fixture_.scene, walls_)),
        file_(folder_ / "series.h5"),
        out_(std::make_unique<Hdf5Writer>(file_)) {
    fixture_.name = "random";
    for (int k = 0; k < 4; ++k) {
      ParticleState state = fixture_.state;
      state.substep = k;
      state.position += 0.02 * k * fixture_.scene.particle_spacing * state.velocity;
      instants_.push_back(instant_of(fixture_.scene, walls_, volumes_, state));
    }
    out_->attribute("/", "decant_list_series", 1);
  }

  void write_states(const std::vector<int>& lists) {
    for (std::size_t k = 0; k < lists.size(); ++k) {
      const std::string group = "/state/" + std::to_string(k);
      number(group + "/substep", static_cast<std::int64_t>(k));
      number(group + "/list", lists[k]);
      out_->matrix3(group + "/position", instants_[k].state.position, "m");
      out_->matrix3(group + "/velocity", instants_[k].state.velocity, "m/s");
    }
  }
  void write_list(int name, std::int64_t built, const Neighbors& near) {
    const std::string group = "/list/" + std::to_string(name);
    number(group + "/built", built);
    write_kind(group + "/fluid", near.fluid);
    write_kind(group + "/wall", near.wall);
  }
  void number(const std::string& path, std::int64_t value) { out_->integers(path, IdVector::Constant(1, value)); }
  void write_kind(const std::string& path, const std::vector<std::vector<std::int32_t>>& lists) {
    IdVector count(static_cast<Eigen::Index>(lists.size()));
    std::vector<std::int64_t> all;
    for (std::size_t i = 0; i < lists.size(); ++i) {
      count[static_cast<Eigen::Index>(i)] = static_cast<std::int64_t>(lists[i].size());
      all.insert(all.end(), lists[i].rbegin(), lists[i].rend());  // any order will do
    }
    out_->integers(path + "_count", count);
    out_->integers(path, Eigen::Map<IdVector>(all.data(), static_cast<Eigen::Index>(all.size())));
  }
  drift::Result read() {
    out_->commit();
    return drift::measure_series(fixture_, file_);
  }
  /// What is said of it.
  std::string complaint() {
    try {
      (void)read();
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  }

  TemporaryFolder folder_;
  Fixture fixture_;
  Walls walls_;
  WallSolution volumes_;
  std::filesystem::path file_;
  std::unique_ptr<Hdf5Writer> out_;
  std::vector<Instant> instants_;
};

TEST_F(Series, IsLookedAtAsOurOwnListsAre) {
  write_states({0, 0, 1, 1});
  write_list(0, 0, instants_[0].near);
  write_list(1, 2, instants_[2].near);
  const drift::Result result = read();
  ASSERT_EQ(result.samples.size(), 4u);
  for (const std::size_t built : {0u, 2u}) {
    const StaleList own(fixture_.scene, volumes_.volume, instants_[built], 0);
    for (const std::size_t age : {0u, 1u}) {
      const Staleness expected = own.at(instants_[built + age]), got = result.samples[built + age].stale;
      EXPECT_EQ(got.age, static_cast<std::int64_t>(age));
      EXPECT_EQ(got.fluid.missed, expected.fluid.missed);
      EXPECT_EQ(got.wall.missed, expected.wall.missed);
      EXPECT_EQ(got.fluid.missed > 0, age > 0);
      EXPECT_EQ(got.acceleration.relative_rms, expected.acceleration.relative_rms);
      EXPECT_EQ(got.farthest, expected.farthest);
    }
  }
  EXPECT_EQ(result.rows.front().first_miss, 1);
  // Nobody knows what to expect of it, and nothing is not 0.
  EXPECT_TRUE(std::isnan(result.rows.front().expected.missed_share));
  EXPECT_TRUE(std::isnan(result.rows.front().expected.density_rms));
  EXPECT_TRUE(std::isnan(result.rows.front().expected.acceleration_rms));
}

TEST_F(Series, ThatHasEachPairOnceIsRecognised) {
  write_states({0});
  Neighbors half = instants_[0].near;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < half.fluid.size(); ++i) {
    std::erase_if(half.fluid[i], [&](std::int32_t j) { return j < static_cast<std::int32_t>(i); });
    pairs += half.fluid[i].size();
  }
  ASSERT_GT(pairs, 10u);
  write_list(0, 0, half);
  const std::string said = complaint();
  EXPECT_NE(said.find("/list/0/fluid = " + std::to_string(pairs) + " pairs"), std::string::npos) << said;
  EXPECT_NE(said.find("half list"), std::string::npos) << said;
}

TEST_F(Series, WithABrokenListIsRefusedNamingTheEntry) {
  write_states({0});
  Neighbors near = instants_[0].near;
  std::size_t i = 0;
  while (near.fluid[i].empty()) ++i;
  near.fluid[i].push_back(near.fluid[i].front());
  write_list(0, 0, near);
  const std::string said = complaint();
  EXPECT_NE(said.find("/list/0/fluid"), std::string::npos) << said;
  EXPECT_NE(said.find("twice"), std::string::npos) << said;
}

TEST_F(Series, WithAListFromTheFutureIsRefused) {
  write_states({0, 0});
  write_list(0, 1, instants_[1].near);
  EXPECT_NE(complaint().find("/state/0/list"), std::string::npos);
}

TEST_F(Series, WithAListOfAnUnknownParticleOrStateIsRefused) {
  write_states({0});
  Neighbors near = instants_[0].near;
  near.wall[0].push_back(static_cast<std::int32_t>(walls_.size()));
  write_list(0, 0, near);
  EXPECT_NE(complaint().find("/list/0/wall"), std::string::npos);
  out_ = std::make_unique<Hdf5Writer>(file_);
  out_->attribute("/", "decant_list_series", 1);
  write_states({0});
  write_list(0, 7, instants_[0].near);
  EXPECT_NE(complaint().find("/list/0/built"), std::string::npos);
}

}  // namespace
}  // namespace decant
