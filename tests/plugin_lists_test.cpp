/// \file
/// Plug-ins under drift: the lists that they give are checked, and are worth what lists of the same interval and skin
/// are; those that give none are seen by their fields and where they go.
#include "oracle/files/fixture_file.hpp"
#include "oracle/plugin/plugin_backend.hpp"
#include "reference/error.hpp"
#include "reference/neighbors.hpp"
#include "reference/sampling.hpp"
#include "tests/built_files.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/drift/drift.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <ostream>
#include <string>

namespace decant {
namespace {

/// Small, with walls that turn.
const Fixture& tilting() {
  static const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-bowl.h5");
  return fixture;
}

std::unique_ptr<Backend> started(const std::string& name, const std::string& options = {}) {
  return make_plugin_backend(test::plugin_file(name) + options);
}

drift::ListMaker lists_of(const std::string& name) {
  return [name](const drift::ListChoice& list, bool) {
    const std::string options = list.options();
    return started(name, options.empty() ? "" : ":" + options);
  };
}

TEST(PluginLists, AreWorthWhatTheirIntervalAndSkinAre) {
  const drift::Plan plan{drift::all_lists({1, 6}, {0, 0.05}), true, 12, true};
  const drift::Result result = drift::measure(tilting(), plan, lists_of("listing"));
  ASSERT_EQ(result.rows.size(), 5U);
  for (const drift::Row& row : result.rows) {
    // Built in fp32 and compared in double: pairs at the very edge may differ.
    EXPECT_NEAR(row.own_missed_share, row.missed_share, 0.02 * row.missed_share) << row.list.interval;
    EXPECT_NEAR(row.own_wall_missed_share, row.wall_missed_share, 0.02 * row.wall_missed_share);
    EXPECT_EQ(row.deviation, 0);  // its lists are not used
    EXPECT_GT(row.substep_us, 0);
    if (row.list.interval > 0) {
      EXPECT_NEAR(row.rebuild_every, row.list.interval, 0.5);
    }
  }
  EXPECT_GT(result.rows[1].own_missed_share, 0);
  EXPECT_GT(result.rows[1].own_missed_share, result.rows[3].own_missed_share);
}

TEST(PluginLists, ThatNobodyChoosesAreMeasuredAsTheyAre) {
  const drift::Plan plan{{}, false, 8, true};
  for (const char* options : {"", ":rebuild=6"}) {
    const drift::Result result = drift::measure(
        tilting(), plan, [&](const drift::ListChoice&, bool) { return started("fixed_listing", options); });
    ASSERT_EQ(result.rows.size(), 1U);
    const drift::Row& row = result.rows.front();
    EXPECT_EQ(row.list.interval, -1);
    EXPECT_EQ(row.own_missed_share, row.missed_share);
    EXPECT_EQ(row.missed_share > 0, *options != '\0') << row.missed_share;
    EXPECT_EQ(row.acceleration_rms > 0, *options != '\0');
    EXPECT_GT(row.deviation, 0);  // from the oracle, by rounding
    EXPECT_LT(row.deviation_over_ensemble, 3);
    EXPECT_EQ(result.samples.size(), 8U);
  }
}

TEST(PluginLists, AreNotNeededToSeeFields) {
  const drift::Plan plan{{}, false, 4, true};
  const auto row_of = [&](const char* name, const char* options) {
    const drift::Result result =
        drift::measure(tilting(), plan, [&](const drift::ListChoice&, bool) { return started(name, options); });
    EXPECT_EQ(result.rows.size(), 1U);
    EXPECT_TRUE(result.samples.empty());
    EXPECT_NE(drift::table({result}).find("own"), std::string::npos);
    return result.rows.front();
  };
  const drift::Row sound = row_of("all_pairs", ""), wrong = row_of("faulty", ":fault=wrong"),
                   no_number = row_of("faulty", ":fault=nan");
  EXPECT_TRUE(std::isnan(sound.missed_share));
  EXPECT_TRUE(std::isnan(sound.own_missed_share));
  EXPECT_GT(sound.density_rms, 0);
  EXPECT_LT(sound.density_rms, 1e-6);
  EXPECT_LE(sound.density_score, 1);
  EXPECT_LE(sound.acceleration_score, 1);
  EXPECT_GT(wrong.acceleration_score, 10);
  EXPECT_TRUE(std::isnan(no_number.density_rms));
  EXPECT_FALSE(no_number.density_score <= 1);
}

struct ListFault {
  const char* name;
  const char* message;  // part of it
};
void PrintTo(const ListFault& fault, std::ostream* out) { *out << fault.name; }

class FaultyLists : public testing::TestWithParam<ListFault> {};

TEST_P(FaultyLists, AreRefusedInWords) {
  const auto backend = started("listing", std::string(":lists=") + GetParam().name);
  const Walls walls = sample_walls(tilting().scene);
  try {
    (void)drift::missed_of_given_lists(tilting(), walls, *backend, 2);
    ADD_FAILURE() << "accepted";
  } catch (const BackendError& error) {
    EXPECT_NE(std::string(error.what()).find(GetParam().message), std::string::npos) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(Each, FaultyLists,
                         testing::Values(ListFault{"half", "none of them in both lists"},
                                         ListFault{"self", "in its own list"},
                                         ListFault{"range", "entry 380 of particle"},
                                         ListFault{"offsets", "fluid_offsets of particle 1 go from"},
                                         ListFault{"built", "were built at substep -1000, which is not from 0 to 0"}),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(PluginLists, AreAskedOfWhoOffersThem) {
  Neighbors none;
  EXPECT_THROW((void)choose_backend("hash", "host")->lists(none), BackendError);
  const auto without = started("all_pairs");
  without->load(tilting().scene, sample_walls(tilting().scene), tilting().state);
  EXPECT_THROW((void)without->lists(none), BackendError);
}

TEST(PluginTimes, ArriveByStage) {
  const auto backend = started("listing", ":rebuild=2");
  EXPECT_EQ(backend->stage_times().build.calls, 0);
  backend->load(tilting().scene, sample_walls(tilting().scene), tilting().state);
  EXPECT_TRUE(backend->advance(4).ok());
  const StageTimes times = backend->stage_times();
  EXPECT_EQ(times.build.seconds, 1);
  EXPECT_EQ(times.force.seconds, 3);
  EXPECT_EQ(times.integrate.calls, 40);
  EXPECT_EQ(backend->neighbor_stats().rebuilds, 2);
  const auto without = started("all_pairs");
  without->load(tilting().scene, sample_walls(tilting().scene), tilting().state);
  EXPECT_EQ(without->stage_times().force.calls, 0);
}

}  // namespace
}  // namespace decant
