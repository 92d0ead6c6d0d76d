/// \file
/// What the loop of a live run (run.cpp) and its answers to a page (answers.cpp) share.
#pragma once

#include "oracle/checks/audit.hpp"
#include "tools/common/clock.hpp"
#include "tools/live/background.hpp"
#include "tools/live/colors.hpp"
#include "tools/live/page_messages.hpp"
#include "tools/live/run.hpp"
#include "tools/live/scores.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace decant::live {

using nlohmann::ordered_json;
using SharedState = std::shared_ptr<const ParticleState>;

class Run::Implementation {
 public:
  Implementation(LiveScene scene, Options options, Viewer& viewer)
      : options_(std::move(options)),
        viewer_(viewer),
        scene_(std::move(scene)),
        recorded_substeps_(scene_.running().schedule.substeps_per_frame),
        from_(options_.start),
        paused_(options_.paused) {}

  void ask(std::string json);
  void begin();
  void go(const std::function<bool()>& stop);
  bool busy() const { return !keeping_.idle() || !scoring_.idle(); }

 private:
  bool advances() const { return (!paused_ || steps_ > 0) && failed_.empty(); }

  void rest(double seconds);
  double interval() const;
  void answer();
  void answer(const ordered_json& ask);
  void start();
  void start_anew(const LiveScene& before, const std::string& why);
  void adopt(ParticleState state);
  void load();
  void change_backend(const std::string& choice);
  void keep(bool judged);
  void beside(Background& where, std::function<void()> work);
  void tell_scene();
  void fail(const std::string& why);
  ParticleState state_now();
  std::int64_t substeps_until(double seconds);
  void advance(std::int64_t n);
  void show();
  void score(const SharedState& state);
  void audit(const SharedState& state);
  LoopStatus loop_status();
  Results results() {
    const std::lock_guard lock(mutex_);
    return results_;
  }
  void set_pace() {
    paced_from_ = Clock::now();
    paced_substep_ = substep_;
  }

  const Options options_;
  Viewer& viewer_;
  LiveScene scene_;
  const int recorded_substeps_;           // of a frame, by which from_ counts
  std::optional<ParticleState> from_;     // where the run starts, while it has the recording's particles
  std::shared_ptr<const Scene> running_;  // a copy that others may hold
  Walls walls_;
  std::string choice_;
  std::unique_ptr<Backend> backend_;
  std::int64_t substep_ = 0;
  std::int64_t steps_ = 0;  // single substeps still to do
  bool paused_ = false;
  std::string failed_;
  SharedState last_;    // that was shown
  bool stale_ = false;  // the last picture is not of the present state, or in other colors
  double speed_ = 0;
  Quantity quantity_ = Quantity::speed;

  double rate_ = 0;          // substeps per s
  double picture_cost_ = 0;  // s of the loop
  double picture_rate_ = 0;
  Clock::time_point shown_{}, told_{}, paced_from_{};
  std::int64_t paced_substep_ = 0, told_substep_ = 0;
  StageTimes stages_before_;
  Fields fields_;  // density and pressure of a picture

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::string> asked_;                // by mutex_
  Results results_;                              // by mutex_
  std::atomic<double> audit_cost_ = 0;           // s
  std::shared_ptr<const Scene> audited_;         // audit_'s
  std::optional<Audit> sampler_;                 // audit_'s
  std::optional<WallSolution> wall_solution_;    // scoring_'s; of the present walls
  Background view_, audit_, scoring_, keeping_;  // last: they use the above
};

}  // namespace decant::live
