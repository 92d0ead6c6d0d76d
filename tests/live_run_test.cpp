/// \file
/// The loop of `decant live` without a browser: what it shows, what it does when asked, what becomes of a run that fails.
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "oracle/solution/reference_backend.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "tests/live/cups.hpp"
#include "tools/live/picture.hpp"
#include "tools/live/run.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace decant::live {
namespace {

using nlohmann::ordered_json;
using test::cups;

/// Looks, and notes what it sees.
class Notes : public Viewer {
 public:
  bool watched() const override { return true; }
  bool wants_picture() const override { return true; }
  void picture(Message bytes) override {
    const std::lock_guard lock(mutex_);
    picture_ = std::move(bytes);
    ++pictures_;
  }
  void tell(const ordered_json& message) override {
    const std::lock_guard lock(mutex_);
    told_.push_back(message);
  }
  /// The last of a kind that was told; null: none.
  ordered_json last(const std::string& type) const {
    const std::lock_guard lock(mutex_);
    for (auto m = told_.rbegin(); m != told_.rend(); ++m)
      if (m->at("type") == type) return *m;
    return nullptr;
  }
  double of_picture(std::size_t k) const {
    const std::lock_guard lock(mutex_);
    double number = -1;
    if (picture_) std::memcpy(&number, picture_->data() + 8 * k, 8);
    return number;
  }
  double substep() const { return of_picture(3); }
  int pictures() const {
    const std::lock_guard lock(mutex_);
    return pictures_;
  }

 private:
  mutable std::mutex mutex_;
  Message picture_;
  int pictures_ = 0;
  std::vector<ordered_json> told_;
};

/// The reference, until a particle escapes, if one is to. It notes how many substeps each call takes.
class Noting : public Backend {
 public:
  Noting(std::vector<int>& calls, bool fails) : calls_(calls), fails_(fails) {}
  BackendInfo info() const override { return inner_->info(); }
  void load(const Scene& scene, const Walls& walls, const ParticleState& state) override {
    now_ = state.substep;
    inner_->load(scene, walls, state);
  }
  Status evaluate(Fields& out, const StageInputs* given) override { return inner_->evaluate(out, given); }
  Status advance(int substeps) override {
    now_ += substeps;
    calls_.push_back(substeps);
    return fails_ && now_ > 40 ? Status{Status::escaped, 17, now_} : inner_->advance(substeps);
  }
  void read(ParticleState& out) const override { inner_->read(out); }
  StageTimes stage_times() const override { return inner_->stage_times(); }
  NeighborStats neighbor_stats() const override { return inner_->neighbor_stats(); }

 private:
  std::vector<int>& calls_;
  const bool fails_;
  std::unique_ptr<Backend> inner_ = make_reference_backend();
  std::int64_t now_ = 0;
};

class LiveRun : public testing::Test {
 protected:
  void begin(const std::string& backend = "reference", bool paused = false) {
    Options options;
    options.backend = backend;
    options.backends = {"reference", "failing"};
    options.make_backend = [this](const std::string& choice) -> std::unique_ptr<Backend> {
      const bool fails = choice == "failing";
      if (choice == "absent") throw BackendError("not here");
      if (!fails && !choice.starts_with("reference"))
        throw InputError("command line", "--backend", choice, "reference or failing");
      return std::make_unique<Noting>(calls_, fails);
    };
    options.keep = folder_.path();
    options.start = start_;
    options.paused = paused;
    run_ = std::make_unique<live::Run>(cups(), std::move(options), notes_);
    run_->start();
    thread_ = std::thread([this] { run_->go([this] { return stop_.load(); }); });
  }
  void TearDown() override {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  void ask(const ordered_json& json) { run_->ask(json.dump()); }
  /// Whether it comes true within some seconds.
  template <class Condition>
  bool soon(Condition condition, double seconds = 20) {
    const auto start = std::chrono::steady_clock::now();
    while (!condition()) {
      if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }
  std::string told(const char* type, const char* key) const {
    const ordered_json last = notes_.last(type);
    return last.is_null() || !last.contains(key) ? "" : last.at(key).get<std::string>();
  }

  TemporaryFolder folder_;
  std::vector<int> calls_;  // the run's
  std::optional<ParticleState> start_;
  Notes notes_;
  std::unique_ptr<live::Run> run_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

TEST_F(LiveRun, ShowsPicturesAndFigures) {
  begin();
  ASSERT_TRUE(soon([&] { return notes_.substep() > 20 && !notes_.last("status").is_null(); }));
  EXPECT_EQ(notes_.last("scene").at("particles"), 192);
  const ordered_json status = notes_.last("status");
  double mass = 0;
  for (const auto& [region, kg] : status.at("mass").items()) mass += kg.get<double>();
  EXPECT_NEAR(mass, 192 * cups().running().particle_mass(), 1e-9);
}

TEST_F(LiveRun, StepsOneSubstepWhilePaused) {
  begin("reference", true);
  ASSERT_TRUE(soon([&] { return notes_.pictures() > 0; }));
  EXPECT_EQ(notes_.substep(), 0);
  ask({{"do", "step"}});
  ASSERT_TRUE(soon([&] { return notes_.substep() == 1; }));
  ask({{"do", "step"}});
  ask({{"do", "step"}});
  ASSERT_TRUE(soon([&] { return notes_.substep() == 3; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(notes_.substep(), 3);
  ask({{"do", "go_on"}});
  ASSERT_TRUE(soon([&] { return notes_.substep() > 10; }));
  ask({{"do", "pause"}});
  ask({{"do", "reset"}});
  ASSERT_TRUE(soon([&] { return notes_.substep() == 0; }));
}

TEST_F(LiveRun, KeepsToTheSpeedThatWasAskedFor) {
  begin();
  ask({{"do", "speed"}, {"value", 0.01}});
  ASSERT_TRUE(soon([&] { return notes_.substep() > 0; }));
  const double first = notes_.of_picture(4);
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(soon([&] { return notes_.of_picture(4) > first + 0.008; }));
  EXPECT_GT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 0.7);
}

TEST_F(LiveRun, TellsWhatIsWrongAndGoesOn) {
  begin();
  for (const auto& [asked, answer] : std::vector<std::pair<std::string, std::string>>{
           {R"({"do":"set","pointer":"/fluid/viscosity","value":-1})", "cups.json: fluid.viscosity = -1"},
           {R"({"do":"set","pointer":"/containers/9999999999999","value":1})", "no such place"},
           {R"({"do":"set","pointer":"/gravity/3","value":1})", "no such place"},
           {R"({"do":"particles","value":100000000000})", "this machine's memory"},
           {R"({"do":"backend","choice":"teapot"})", "--backend = teapot"},
           {R"({"do":"backend","choice":"absent"})", "not here"},
           {R"({"do":"tilt","container":"receiver","degrees":3})", "a container that can tilt"},
           {R"({"do":"color","by":"mood"})", "mood"},
           {R"({"do":"dance"})", "dance"},
           {R"({"do":7})", "not understood"},
           {"{", "not understood"},
           {R"({"do":"set"})", "not understood"}}) {
    run_->ask(asked);
    EXPECT_TRUE(soon([&] { return told("error", "text").find(answer) != std::string::npos; })) << asked;
  }
  const double now = notes_.substep();
  EXPECT_TRUE(soon([&] { return notes_.substep() > now; }));
}

TEST_F(LiveRun, ChangesTheSceneInARunAndStartsAnewWhereItMust) {
  begin();
  ASSERT_TRUE(soon([&] { return notes_.substep() > 10; }));
  ask({{"do", "set"}, {"pointer", "/gravity"}, {"value", {0, 0, -2}}});
  ASSERT_TRUE(soon([&] { return notes_.last("scene").at("gravity") == ordered_json({0.0, 0.0, -2.0}); }));
  EXPECT_GT(notes_.substep(), 10);
  EXPECT_EQ(told("note", "text"), "");
  ask({{"do", "set"}, {"pointer", "/fill/0/level"}, {"value", 0.02}});
  ASSERT_TRUE(soon([&] { return notes_.last("scene").at("particles") == 96; }));
  EXPECT_NE(told("note", "text").find("starts anew"), std::string::npos);
  EXPECT_TRUE(soon([&] { return notes_.of_picture(1) == 96; }));
}

TEST_F(LiveRun, AFailureStopsTheRunUntilItIsReset) {
  begin("failing");
  ASSERT_TRUE(soon([&] { return told("error", "text").find("outside the domain") != std::string::npos; }));
  EXPECT_NE(told("error", "text").find("particle 17"), std::string::npos);
  ASSERT_TRUE(soon([&] { return !told("status", "failed").empty(); }));
  const double stopped = notes_.substep();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(notes_.substep(), stopped);
  EXPECT_LE(stopped, 40);
  ask({{"do", "backend"}, {"choice", "reference"}});
  EXPECT_TRUE(soon([&] { return notes_.substep() > 60; })) << "from the state that was shown last";
  ask({{"do", "reset"}});
  EXPECT_TRUE(soon([&] { return notes_.substep() < 60; }));
}

TEST_F(LiveRun, KeepsAndJudgesTheInstant) {
  begin();
  ASSERT_TRUE(soon([&] { return notes_.substep() > 300; }));
  ask({{"do", "tilt"}, {"container", "source"}, {"degrees", 90}});
  ask({{"do", "judge"}});
  ASSERT_TRUE(soon([&] { return !notes_.last("verdict").is_null(); }, 120));
  const ordered_json verdict = notes_.last("verdict");
  EXPECT_EQ(verdict.at("verdict"), "pass") << verdict.dump(1);
  EXPECT_GT(verdict.at("rows").size(), 20u);
  const Fixture kept = read_fixture(verdict.at("file").get<std::string>());
  EXPECT_GT(kept.state.substep, 300);
  EXPECT_EQ(kept.state.size(), 192);
  EXPECT_NE(kept.scene.containers[0].tilt->rate, 0) << "the cup as the hand turns it";
  ask({{"do", "pause"}});
  ask({{"do", "keep"}});
  ASSERT_TRUE(soon([&] { return told("kept", "file") != verdict.at("file").get<std::string>(); }, 60));
  const std::string second = told("kept", "file");
  ask({{"do", "keep"}});
  ASSERT_TRUE(soon([&] { return told("kept", "file") != second; }, 60)) << "beside the one before";
  EXPECT_TRUE(std::filesystem::exists(second));
}

TEST_F(LiveRun, TellsWhereNoBackendCanBeJudged) {
  begin("reference", true);  // on its lattice, where hundreds of pairs are at H
  ask({{"do", "judge"}});
  ASSERT_TRUE(soon([&] { return told("kept", "objection").find("no backend can pass") != std::string::npos; }, 60));
  EXPECT_TRUE(notes_.last("verdict").is_null());
}

TEST_F(LiveRun, ListsOfAFixedIntervalGetAsOldAsWasAsked) {
  begin("reference:rebuild=37");
  ASSERT_TRUE(soon([&] { return notes_.substep() > 37 * 4; }));
  TearDown();
  ASSERT_GT(calls_.size(), 2u);
  for (const int substeps : calls_) EXPECT_EQ(substeps % 37, 36) << "lists one substep before they are rebuilt";
}

TEST_F(LiveRun, AResetOfARecordingIsAtItsTimeWhateverTheSubstep) {
  LiveScene scene = cups();
  start_.emplace(initial_state(scene.running()));
  start_->substep = 3000;
  begin("reference", true);
  ASSERT_TRUE(soon([&] { return notes_.pictures() > 0; }));
  const double time = notes_.of_picture(4);
  EXPECT_NEAR(time, scene.running().time_at(3000), 1e-12);
  ask({{"do", "set"}, {"pointer", "/fluid/viscosity"}, {"value", 30.0}});
  ask({{"do", "reset"}});
  ASSERT_TRUE(soon([&] { return notes_.substep() > 3000; })) << "of shorter substeps";
  EXPECT_NEAR(notes_.of_picture(4), time, 1e-12);
  ask({{"do", "set"}, {"pointer", "/fill/0/level"}, {"value", 0.02}});
  ASSERT_TRUE(soon([&] { return notes_.of_picture(1) == 96 && notes_.substep() == 0; })) << "no longer the recording";
}

TEST_F(LiveRun, StepsAfterAFailureAreNotKept) {
  begin("failing");
  ASSERT_TRUE(soon([&] { return !told("status", "failed").empty(); }));
  for (int k = 0; k < 5; ++k) ask({{"do", "step"}});
  ask({{"do", "reset"}});
  ASSERT_TRUE(soon([&] { return notes_.substep() == 0; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(notes_.substep(), 0);
}

TEST_F(LiveRun, ScoresFollow) {
  begin();
  ask({{"do", "color"}, {"by", "score"}});
  ASSERT_TRUE(soon([&] { return !notes_.last("scores").is_null(); }));
  EXPECT_LT(notes_.last("scores").at("largest").get<double>(), 1e-6) << "of the oracle against itself";
  EXPECT_EQ(notes_.of_picture(5), 4);
}

}  // namespace
}  // namespace decant::live
