/// \file
/// Plug-ins: the example passes every check, whatever a plug-in does is a row that says what happened, and tables
/// that are not ours are refused.
#include "oracle/plugin.h"
#include "gpu/backends.hpp"
#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "oracle/plugin/plugin_backend.hpp"
#include "oracle/report/console_table.hpp"
#include "reference/error.hpp"
#include "reference/neighbors.hpp"
#include "reference/sampling.hpp"
#include "tests/built_files.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/fuzz/campaign.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <vector>

namespace decant {
namespace {

using test::plugin_file;

std::unique_ptr<Backend> plugin_called(const std::string& name, const std::string& options = {}) {
  return make_plugin_backend(plugin_file(name) + options);
}

/// Small, with walls that turn.
const Fixture& bowl() {
  static const Fixture fixture = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-bowl.h5");
  return fixture;
}
const PreparedReference& prepared_bowl() {
  static const PreparedReference prepared = prepare_reference(bowl());
  return prepared;
}
std::vector<CheckRow> judged(Backend& backend, const CheckSelection& checks) {
  return run_checks(backend, bowl(), prepared_bowl(), checks);
}
std::string message_of(const std::string& choice) {
  try {
    make_plugin_backend(choice);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "accepted";
}

TEST(PluginHeader, GrowsAtItsEndsOnly) {
  EXPECT_EQ(offsetof(decant_scene, distance) + sizeof(void*), 240U);
  EXPECT_EQ(offsetof(decant_walls, container) + sizeof(void*), 32U);
  EXPECT_EQ(offsetof(decant_state, velocity) + sizeof(void*), 40U);
  EXPECT_EQ(offsetof(decant_given, pressure) + sizeof(void*), 32U);
  EXPECT_EQ(offsetof(decant_fields, wall_neighbor_id_sum) + sizeof(void*), 120U);
  EXPECT_EQ(offsetof(decant_status, substep) + sizeof(std::int64_t), 24U);
  EXPECT_EQ(offsetof(decant_lists, wall) + sizeof(void*), 48U);
  EXPECT_EQ(offsetof(decant_stage_times, rebuilds) + sizeof(std::int64_t), 80U);
  EXPECT_EQ(offsetof(decant_plugin_table, bytes) + sizeof(void*), 104U);
  EXPECT_EQ(offsetof(decant_plugin_table, stage_times) + sizeof(void*), 120U);
  EXPECT_EQ(offsetof(decant_pose, surface_velocity), 168U);
}

TEST(Plugin, ExamplePassesEveryCheck) {
  const auto backend = plugin_called("all_pairs");
  EXPECT_EQ(backend->info().name, "all-pairs");
  EXPECT_EQ(backend->info().executor, "plug-in");
  const auto rows = judged(*backend, all_checks());
  EXPECT_GT(rows.size(), 40U);
  for (const CheckRow& row : rows)
    EXPECT_EQ(verdict_of(row), Verdict::pass) << row.check << ' ' << row.field << ' ' << row.reason;
}

TEST(Plugin, StateGoesInAndComesBackBitByBit) {
  const auto backend = plugin_called("all_pairs");
  const Walls walls = sample_walls(bowl().scene);
  ParticleState back;
  backend->load(bowl().scene, walls, bowl().state);
  backend->read(back);
  EXPECT_TRUE(back.position == bowl().state.position);
  EXPECT_TRUE(back.velocity == bowl().state.velocity);
  EXPECT_EQ(back.substep, bowl().state.substep);
  ParticleState none = bowl().state;
  none.position.resize(3, 0);
  none.velocity.resize(3, 0);
  backend->load(bowl().scene, walls, none);
  EXPECT_TRUE(backend->advance(2).ok());
  backend->read(back);
  EXPECT_EQ(back.size(), 0);
  EXPECT_EQ(back.substep, none.substep + 2);
}

TEST(Plugin, WithoutAStateSaysSo) {
  const auto backend = plugin_called("all_pairs");
  EXPECT_THROW((void)backend->advance(1), BackendError);
  ParticleState state;
  EXPECT_THROW(backend->read(state), BackendError);
}

TEST(Plugin, ThatCrashesInOneCheckIsAskedTheOthers) {
  const auto backend = plugin_called("faulty", ":fault=crash");
  std::map<std::string, Verdict> worst;
  for (const CheckRow& row : judged(*backend, all_checks())) {
    auto& verdict = worst.emplace(row.check, Verdict::pass).first->second;
    if (verdict_of(row) == Verdict::fail) verdict = Verdict::fail;
  }
  for (const auto* check : {"density", "evaluation", "acceleration"})
    EXPECT_EQ(worst.at(check), Verdict::pass) << check;
  for (const auto* check : {"run", "substep", "contact", "advanced", "trajectory", "mass", "containment", "determinism",
                            "conservation", "invariance", "status"})
    EXPECT_EQ(worst.at(check), Verdict::fail) << check;
}

struct PluginFault {
  const char* name;
  const char* check;   // that fails
  const char* reason;  // part of it
};
void PrintTo(const PluginFault& fault, std::ostream* out) { *out << fault.name; }

class FaultyPlugin : public testing::TestWithParam<PluginFault> {};

TEST_P(FaultyPlugin, IsARowThatSaysWhatHappened) {
  const auto [name, check, reason] = GetParam();
  const auto backend = plugin_called("faulty", std::string(":time_limit=2:fault=") + name);
  const auto rows = judged(*backend, {"fields", "substep"});
  bool found = false;
  for (const CheckRow& row : rows)
    found |= row.check == check && verdict_of(row) == Verdict::fail && row.reason.find(reason) != std::string::npos;
  EXPECT_TRUE(found) << console_table({rows, {}});
  EXPECT_TRUE(std::ranges::any_of(
      rows, [&](const CheckRow& row) { return row.check == "density" || row.check == "evaluation"; }));
  // And the next state finds a plug-in that works, until it fails again.
  EXPECT_NO_THROW(backend->load(bowl().scene, prepared_bowl().walls, bowl().state));
}

INSTANTIATE_TEST_SUITE_P(
    Each, FaultyPlugin,
    testing::Values(PluginFault{"crash", "run",
                                "advance by 1 at substep 0, 380 particles: its process was ended by signal 6"},
                    PluginFault{"throws", "run", "evaluate: nobody catches this"},
                    PluginFault{"leaves", "run", "its process left with exit status 7"},
                    PluginFault{"hangs", "run", "no answer within 2 s; ended"},
                    PluginFault{"beyond", "run", "wrote beyond density"},
                    PluginFault{"before", "run", "wrote before fluid_neighbor_count"},
                    PluginFault{"error", "run", "evaluate: out of luck"}, PluginFault{"nan", "density", ""},
                    PluginFault{"unwritten", "pressure", ""}, PluginFault{"wrong", "evaluation", "beyond tolerance"},
                    PluginFault{"echoes", "equation_of_state", "beyond tolerance"},
                    PluginFault{"short", "substep", "beyond tolerance"}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(Plugin, IsOnlyAskedForWhatItOffers) {
  const auto backend = plugin_called("fields_only");
  const Report report{judged(*backend, all_checks()), {}};
  std::set<std::string> passed, left_out;
  for (const CheckRow& row : report.rows) {
    EXPECT_NE(verdict_of(row), Verdict::fail) << row.check << ' ' << row.reason;
    (verdict_of(row) == Verdict::pass ? passed : left_out).insert(row.check);
    EXPECT_EQ(verdict_of(row) == Verdict::not_run, row.reason == not_offered);
  }
  // A bowl has wall particles, which it does not know.
  EXPECT_EQ(passed, std::set<std::string>());
  EXPECT_EQ(exit_status(report), 3);

  const Fixture open = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-periodic-box.h5");
  const Report judged_open{run_checks(*backend, open, prepare_reference(open), all_checks()), {}};
  EXPECT_EQ(exit_status(judged_open), 0) << console_table(judged_open);
  passed.clear();
  for (const CheckRow& row : judged_open.rows)
    if (verdict_of(row) == Verdict::pass) passed.insert(row.check);
  EXPECT_EQ(passed, (std::set<std::string>{"density", "pressure", "evaluation", "invariance"}));
  EXPECT_NE(console_table(judged_open).find("does not offer what these need: "), std::string::npos);
}

TEST(Plugin, ThatOffersNothingIsNotJudged) {
  const auto backend = plugin_called("nothing");
  EXPECT_EQ(exit_status({judged(*backend, all_checks()), {}}), 3);
}

TEST(Plugin, OfOtherVersionsOfTheHeader) {
  // Built when the table was shorter, or offers were more.
  for (const char* name : {"older_table", "future_offers"}) {
    const auto backend = plugin_called(name);
    EXPECT_EQ(exit_status({judged(*backend, {"fields", "substep"}), {}}), 0) << name;
    EXPECT_EQ(backend->neighbor_stats().device_bytes, 0) << name;
  }
}

TEST(Plugin, ThatIsNoneIsRefusedInWords) {
  EXPECT_NE(message_of(plugin_file("other_abi")).find("is built for ABI 2; this program has 1"), std::string::npos);
  EXPECT_NE(message_of(plugin_file("tiny_table")).find("has a table of 16 bytes; at least"), std::string::npos);
  EXPECT_NE(message_of(plugin_file("no_read")).find("has no advance or read, which its offers need"),
            std::string::npos);
  EXPECT_NE(message_of(plugin_file("no_entry")).find("exports no function decant_plugin"), std::string::npos);
  EXPECT_NE(message_of(DECANT_SOURCE_DIR "/README.md").find("is no library that can be loaded"), std::string::npos);
  EXPECT_NE(message_of("/nowhere.so").find("a shared library"), std::string::npos);
  EXPECT_NE(message_of("").find("plugin:PATH"), std::string::npos);
  EXPECT_NE(message_of(plugin_file("all_pairs") + ":skin=3").find("option skin=3: not known"), std::string::npos);
  EXPECT_NE(message_of(plugin_file("all_pairs") + ":skin").find("options are key=value"), std::string::npos);
  for (const char* limit : {"0", "-1", "", "x", "1e9", "nan"})
    EXPECT_NE(message_of(plugin_file("all_pairs") + ":time_limit=" + limit).find("time_limit is in"), std::string::npos)
        << limit;
}

TEST(Plugin, ThatCrashesDoesNotEndACampaign) {
  const TemporaryFolder folder;
  fuzz::Settings settings;
  const std::string sound = "plugin:" + plugin_file("all_pairs");
  const std::string crashing = "plugin:" + plugin_file("faulty") + ":fault=crash";
  settings.backends = {sound, crashing};
  settings.properties = {"substep"};
  settings.cases = 6;
  settings.threads = 2;
  settings.minimise_tries = 0;
  settings.failures = folder.path() / "failing";
  const fuzz::Campaign campaign =
      fuzz::run_campaign(settings, [](const std::string& choice) { return choose_backend(choice, "auto"); });
  EXPECT_EQ(campaign.cases, 6);
  std::int64_t asked = 0, failed = 0;
  for (const fuzz::PropertyStatistics& statistics : campaign.statistics) {
    EXPECT_TRUE(statistics.backend != sound || statistics.failed == 0);
    asked += statistics.backend == crashing ? statistics.asked : 0;
    failed += statistics.backend == crashing ? statistics.failed : 0;
  }
  EXPECT_GT(failed, 1);
  EXPECT_EQ(failed, asked);
  ASSERT_FALSE(campaign.counterexamples.empty());
  for (const fuzz::Counterexample& found : campaign.counterexamples) {
    EXPECT_NE(found.outcome.reason.find("ended by signal 6"), std::string::npos) << found.outcome.reason;
    EXPECT_EQ(std::filesystem::path(found.file).parent_path(), settings.failures);
    EXPECT_NO_THROW((void)read_fixture(found.file));
  }
}

TEST(Plugin, OfALinkedBackendGivesTheSameBits) {
  const auto linked = choose_backend("list", "host");
  const auto plugin = plugin_called("linked", ":executor=host:fixture=" DECANT_SOURCE_DIR "/fixtures/hostile-bowl.h5");
  const Walls walls = sample_walls(bowl().scene);
  ParticleState states[2];
  Fields fields[2];
  for (int k = 0; k < 2; ++k) {
    Backend& backend = k == 0 ? *linked : *plugin;
    backend.load(bowl().scene, walls, bowl().state);
    EXPECT_TRUE(backend.advance(20).ok());
    backend.read(states[k]);
    fields[k] = Fields::unwritten(states[k].size(), walls.size());
    EXPECT_TRUE(backend.evaluate(fields[k]).ok());
  }
  EXPECT_TRUE(states[0].position == states[1].position);
  EXPECT_TRUE(states[0].velocity == states[1].velocity);
  EXPECT_TRUE(fields[0].acceleration == fields[1].acceleration);
  EXPECT_TRUE(fields[0].fluid_neighbor_id_sum == fields[1].fluid_neighbor_id_sum);
}

TEST(CudaPlugin, ExamplePassesEveryCheck) {
  std::string why_not;
  if (!executor_available(Executor::cuda, &why_not)) GTEST_SKIP() << why_not;
  for (const char* options : {"", ":rebuild=3:skin=0.5"}) {
    const auto backend = plugin_called("cuda_lists", options);
    for (const CheckRow& row : judged(*backend, all_checks()))
      EXPECT_EQ(verdict_of(row), Verdict::pass) << row.check << ' ' << row.field << ' ' << row.reason;
    backend->load(bowl().scene, prepared_bowl().walls, bowl().state);
    Neighbors lists;
    EXPECT_EQ(backend->lists(lists), bowl().state.substep);
    EXPECT_EQ(lists.fluid.size(), static_cast<std::size_t>(bowl().state.size()));
  }
}

TEST(Plugin, IsChosenLikeABackend) {
  EXPECT_EQ(choose_backend("plugin:" + plugin_file("all_pairs"), "auto")->info().precision, "fp32");
  EXPECT_THROW(choose_backend("plugin:" + plugin_file("all_pairs"), "cuda"), InputError);
}

}  // namespace
}  // namespace decant
