/// \file
/// The solver's loop: what was asked, as many substeps as there is time for until a picture is due, the picture. What
/// a picture is made of is read by the loop; colors, bytes and figures are made beside it.
#include "tools/live/run.hpp"

#include "oracle/checks/audit.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "tools/common/clock.hpp"
#include "tools/live/background.hpp"
#include "tools/live/colors.hpp"
#include "tools/live/keep.hpp"
#include "tools/live/page_messages.hpp"
#include "tools/live/scores.hpp"
#include "tools/pour/timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace decant::live {
namespace {

using nlohmann::ordered_json;
using SharedState = std::shared_ptr<const ParticleState>;

// Of the time, what pictures may take; but more than five a second there are where they can be made.
constexpr double share_of_pictures = 0.07, slowest_interval = 0.15;
// s, between two figures of the status.
constexpr double status_interval = 0.25;

Quantity quantity_of(const std::string& name) {
  const auto found = std::ranges::find(quantity_names, name);
  if (found == quantity_names.end())
    throw InputError("page", "color", name, "speed, density, pressure, region or score");
  return static_cast<Quantity>(found - quantity_names.begin());
}

StageTimes operator-(StageTimes a, const StageTimes& b) {
  for (const auto& [name, stage] : pour::stage_names) {
    (a.*stage).seconds -= (b.*stage).seconds;
    (a.*stage).calls -= (b.*stage).calls;
  }
  return a;
}

bool finite(const ParticleState& state) { return pour::all_finite(state.position) && pour::all_finite(state.velocity); }

/// N of lists rebuilt every N substeps; else 1.
std::int64_t rebuild_interval(const std::string& choice) {
  const auto at = choice.find(":rebuild=");
  return at == choice.npos ? 1 : std::max(1L, std::atol(choice.c_str() + at + 9));
}

/// A mean in which the last few count most.
void follow(double& mean, double value) { mean = mean > 0 ? 0.8 * mean + 0.2 * value : value; }

}  // namespace

class Run::Implementation {
 public:
  Implementation(LiveScene scene, Options options, Viewer& viewer)
      : options_(std::move(options)),
        viewer_(viewer),
        scene_(std::move(scene)),
        recorded_substeps_(scene_.running().schedule.substeps_per_frame),
        from_(options_.start),
        paused_(options_.paused) {}

  void ask(std::string json) {
    const std::lock_guard lock(mutex_);
    asked_.push_back(std::move(json));
    wake_.notify_all();
  }

  void begin() {
    choice_ = options_.backend;
    backend_ = options_.make_backend(choice_);
    start();
  }

  void go(const std::function<bool()>& stop) {
    while (!stop()) {
      answer();
      if (!advances()) {
        if (stale_ && viewer_.wants_picture()) show();
        rest(0.01);
        continue;
      }
      const double due = interval() - seconds_since(shown_);
      if (due <= 0 && viewer_.wants_picture() && view_.idle()) {
        show();
        continue;
      }
      const std::int64_t n = substeps_until(viewer_.watched() ? std::clamp(due, 0.005, 0.05) : 0.1);
      if (n == 0) rest(0.002);
      else advance(n);
    }
  }

  bool busy() const { return !keeping_.idle() || !scoring_.idle(); }

 private:
  bool advances() const { return (!paused_ || steps_ > 0) && failed_.empty(); }

  void rest(double seconds) {
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return !asked_.empty(); });
  }

  double interval() const {
    return std::clamp(picture_cost_ / share_of_pictures, 1 / options_.pictures_per_second, slowest_interval);
  }

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
  double picture_rate_ = 0, scene_rate_ = 0;
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

void Run::Implementation::answer() {
  for (;;) {
    std::string text;
    {
      const std::lock_guard lock(mutex_);
      if (asked_.empty()) return;
      text = std::move(asked_.front());
      asked_.pop_front();
    }
    try {
      answer(ordered_json::parse(text));
    } catch (const ordered_json::exception&) {
      viewer_.tell({{"type", "error"}, {"text", "not understood: " + text.substr(0, 200)}});
    } catch (const InputError& error) {
      viewer_.tell({{"type", "error"}, {"text", error.what()}});
    } catch (const std::exception& error) {
      fail(error.what());
    }
    stale_ = true;
  }
}

void Run::Implementation::answer(const ordered_json& ask) {
  const auto text = [&](const char* key) { return ask.at(key).get<std::string>(); };
  const auto what = text("do");
  const LiveScene before = scene_;
  if (what == "pause") {
    paused_ = true;
  } else if (what == "go_on") {
    paused_ = false;
    steps_ = 0;
    set_pace();
  } else if (what == "step") {
    paused_ = true;
    if (failed_.empty()) ++steps_;
  } else if (what == "reset") {
    start();
  } else if (what == "speed") {
    speed_ = std::max(0.0, ask.at("value").get<double>());
    set_pace();
  } else if (what == "set") {
    const auto pointer = text("pointer");
    ParticleState state = state_now();
    if (scene_.set(pointer, ask.at("value"), state.substep) == LiveScene::Outcome::restarts) {
      start_anew(before, pointer + " changes which particles there are");
    } else {
      adopt(std::move(state));
      tell_scene();
      load();
    }
  } else if (what == "particles") {
    scene_.set_particles(ask.at("value").get<std::int64_t>());
    start_anew(before, "other particles");
  } else if (what == "scene") {
    scene_.replace(text("text"));
    start_anew(before, "another scene");
  } else if (what == "backend") {
    change_backend(text("choice"));
  } else if (what == "tilt" || what == "schedule") {
    if (what == "tilt") scene_.tilt(text("container"), ask.at("degrees").get<double>(), substep_);
    else scene_.follow_schedule(text("container"), substep_);
    if (!failed_.empty()) return;
    adopt(state_now());
    load();
  } else if (what == "color") {
    quantity_ = quantity_of(text("by"));
  } else if (what == "keep" || what == "judge") {
    keep(what == "judge");
  } else {
    throw InputError("page", "do", what, "nothing that a page can ask");
  }
}

/// With the scene as it was at first, or as it was set since; from the recording where there is one.
void Run::Implementation::start() {
  scene_.restart(from_ ? recorded_substeps_ : 1);
  Walls walls = sample_walls(scene_.running());
  ParticleState first = from_ ? *from_ : initial_state(scene_.running());
  if (from_) first.substep *= scene_.running().schedule.substeps_per_frame / recorded_substeps_;
  scoring_.wait();
  audit_.wait();
  walls_ = std::move(walls);
  wall_solution_.reset();
  {
    const std::lock_guard lock(mutex_);
    results_ = {};
  }
  rate_ = 0;
  steps_ = 0;
  adopt(std::move(first));
  tell_scene();
  load();
}

/// From a scene that was changed. One that cannot start leaves all as it was.
void Run::Implementation::start_anew(const LiveScene& before, const std::string& why) {
  viewer_.tell({{"type", "note"}, {"text", why + "; the run starts anew"}});
  const auto from = std::exchange(from_, std::nullopt);
  try {
    start();
  } catch (const InputError&) {
    scene_ = before;
    from_ = from;
    throw;
  }
}

/// Takes the scene as it is now, and this state.
void Run::Implementation::adopt(ParticleState state) {
  failed_.clear();
  substep_ = told_substep_ = state.substep;
  told_ = {};
  running_ = std::make_shared<const Scene>(scene_.running());
  last_ = std::make_shared<const ParticleState>(std::move(state));
  fields_ = Fields::unwritten(last_->size(), walls_.size());
  stages_before_ = {};
  stale_ = true;
  set_pace();
}

void Run::Implementation::load() {
  try {
    backend_->load(*running_, walls_, *last_);
  } catch (const InputError& error) {
    throw BackendError(error.what());  // the scene stands, and this backend does not take it
  }
}

/// One that cannot be had, or does not take the scene, leaves the one before.
void Run::Implementation::change_backend(const std::string& choice) {
  ParticleState state = state_now();
  std::unique_ptr<Backend> backend;
  try {
    backend = options_.make_backend(choice);
    backend->load(scene_.running(), walls_, state);
  } catch (const BackendError& error) {
    return viewer_.tell({{"type", "error"}, {"text", fmt::format("{}: {}", choice, error.what())}});
  }
  backend_ = std::move(backend);
  choice_ = choice;
  rate_ = 0;
  adopt(std::move(state));
  tell_scene();
}

void Run::Implementation::fail(const std::string& why) {
  failed_ = why;
  stale_ = true;
  viewer_.tell({{"type", "error"}, {"text", why + "; reset, or change what led there"}});
}

/// The present state; after a failure the one that was shown last.
ParticleState Run::Implementation::state_now() {
  ParticleState state;
  if (failed_.empty()) backend_->read(state);
  if (!failed_.empty() || !finite(state)) return *last_;
  state.substep = substep_;
  return state;
}

std::int64_t Run::Implementation::substeps_until(double seconds) {
  if (steps_ > 0) return 1;
  double n = std::clamp(std::floor(rate_ * seconds), 1.0, 1e6);
  if (speed_ > 0) {
    const double per_second = speed_ / running_->time_step();
    const auto allowed = [&] {
      return per_second * seconds_since(paced_from_) - static_cast<double>(substep_ - paced_substep_);
    };
    // A second that was lost, while a scene was made, is not caught up with.
    if (allowed() > per_second + 1) set_pace();
    n = std::min(n, std::floor(allowed()));
  }
  if (n < 1) return 0;
  auto whole = static_cast<std::int64_t>(n);
  // Lists begin anew with every call. Of a fixed interval they would be younger than was asked for; one substep less
  // than whole intervals, and a picture's scores are those of lists at their oldest. An interval of more than half a
  // second would leave no time to answer.
  if (const std::int64_t interval = rebuild_interval(choice_);
      interval > 1 && static_cast<double>(interval) <= std::max(100.0, 0.5 * rate_))
    whole = (whole + interval) / interval * interval - 1;
  return scene_.until_arrival(substep_, whole);
}

void Run::Implementation::advance(std::int64_t n) {
  const auto before = Clock::now();
  try {
    const Status status = backend_->advance(static_cast<int>(n));
    if (status.bits & ~Status::missed_pair) return fail(describe(status));
    substep_ += n;
    stale_ = true;
    if (steps_ > 0) --steps_;
    // A first call warms up: memory, graphs, threads.
    if (const double seconds = seconds_since(before); n > 1 || rate_ == 0)
      follow(rate_, static_cast<double>(n) / seconds);
    if (!scene_.arrive(substep_)) return;
    adopt(state_now());
    load();
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

void Run::Implementation::tell_scene() {
  viewer_.tell(scene_message(scene_, last_->size(), walls_.size(), backend_->info(), choice_, options_.backends));
}

LoopStatus Run::Implementation::loop_status() {
  LoopStatus loop;
  const double clock = seconds_since(told_);
  loop.paused = paused_;
  loop.failed = failed_;
  loop.speed = speed_;
  loop.substeps_per_second = rate_;
  if (clock < 2) loop.scene_per_second = static_cast<double>(substep_ - told_substep_) * running_->time_step() / clock;
  loop.pictures_per_second = picture_rate_;
  if (failed_.empty()) {
    const StageTimes now = backend_->stage_times();
    loop.stages = now - stages_before_;
    stages_before_ = now;
    loop.neighbors = backend_->neighbor_stats();
  }
  loop.by_hand = scene_.hand_targets();
  told_ = Clock::now();
  told_substep_ = substep_;
  return loop;
}

/// Where `view_` is idle; where the figures are due, those too.
void Run::Implementation::show() {
  if (!view_.idle()) return;
  const auto before = Clock::now();
  follow(picture_rate_, 1 / std::max(1e-3, seconds_since(shown_)));
  shown_ = before;
  stale_ = false;
  auto colors = std::make_shared<Colors>(scale_of(quantity_, *running_));
  try {
    if (failed_.empty()) last_ = std::make_shared<const ParticleState>(state_now());
    if (failed_.empty() && (quantity_ == Quantity::density || quantity_ == Quantity::pressure)) {
      Eigen::VectorXd& wanted = quantity_ == Quantity::density ? fields_.density : fields_.pressure;
      wanted.setConstant(std::numeric_limits<double>::quiet_NaN());
      if (const Status status = backend_->evaluate_density(fields_); !status.ok()) return fail(describe(status));
      colors->values = wanted;
    }
    if (quantity_ == Quantity::score && scoring_.idle() && failed_.empty()) score(last_);
  } catch (const std::exception& error) {
    return fail(error.what());
  }
  beside(view_, [this, state = last_, scene = running_, colors, results = results()] {
    color(*colors, *state, results);
    viewer_.picture(picture_of(*scene, *state, *colors));
  });
  // The threads of a solver on the host are as many as there are cores, and share a substep evenly: what delays one
  // delays all.
  const bool on_host = backend_->info().executor != "cuda";
  if (on_host) view_.wait();
  follow(picture_cost_, seconds_since(before));
  const bool at_rest = paused_ || !failed_.empty();
  if (audit_.idle() &&
      (at_rest || seconds_since(told_) >= std::max(status_interval, audit_cost_ / share_of_pictures))) {
    audit(last_);
    if (on_host) audit_.wait();
  }
}

/// Where the water is, and the status. Of a million particles it takes longer than a picture.
void Run::Implementation::audit(const SharedState& state) {
  beside(audit_, [this, state, scene = running_, loop = loop_status()] {
    const auto start = Clock::now();
    // A scene that changed has other walls to pass: paths are followed from there.
    if (audited_ != scene) sampler_.emplace(*scene);
    audited_ = scene;
    auto result = std::make_shared<const AuditResult>(sampler_->sample(*state));
    viewer_.tell(status_message(*scene, loop, state->substep, *result));
    audit_cost_ = seconds_since(start);
    const std::lock_guard lock(mutex_);
    results_.audit = std::move(result);
  });
}

void Run::Implementation::score(const SharedState& state) {
  auto fields = std::make_shared<Fields>(Fields::unwritten(state->size(), walls_.size()));
  if (const Status status = backend_->evaluate(*fields); !status.ok()) return fail(describe(status));
  beside(scoring_, [this, state, fields, scene = running_] {
    if (!wall_solution_) wall_solution_ = wall_solution(*scene, walls_);
    auto scores = std::make_shared<const Scores>(scores_of(*scene, walls_, *wall_solution_, *state, *fields));
    viewer_.tell(scores_message(*scores));
    const std::lock_guard lock(mutex_);
    results_.scores = std::move(scores);
  });
}

void Run::Implementation::keep(bool judged) {
  if (!keeping_.idle()) throw InputError("page", "keep", "a recording", "one at a time; the one before is not done");
  viewer_.tell({{"type", "note"}, {"text", fmt::format("the oracle evaluates {} particles …", last_->size())}});
  const Instant instant{*running_, state_now(), backend_->info()};
  beside(keeping_, [this, instant, judged, choice = choice_] {
    const auto [path, ill_posed] = keep_instant(instant, options_.keep);
    const std::string file = path.string();
    ordered_json kept = {{"type", "kept"}, {"file", file}, {"judged", judged && ill_posed.empty()}};
    kept["command"] = fmt::format("decant conform '{}' --backend '{}'{}", file, choice,
                                  options_.executor == "auto" ? "" : " --executor " + options_.executor);
    if (!ill_posed.empty()) kept["objection"] = "no verdict: " + ill_posed;
    viewer_.tell(kept);
    if (!judged || !ill_posed.empty()) return;
    ordered_json verdict = judge(path, *options_.make_backend(choice));
    verdict["type"] = "verdict";
    verdict["file"] = file;
    viewer_.tell(verdict);
  });
}

/// What fails beside the loop is told, and the run goes on.
void Run::Implementation::beside(Background& where, std::function<void()> work) {
  where.start([this, work = std::move(work)] {
    try {
      work();
    } catch (const std::exception& error) {
      viewer_.tell({{"type", "error"}, {"text", error.what()}});
    }
  });
}

Run::Run(LiveScene scene, Options options, Viewer& viewer)
    : implementation_(std::make_unique<Implementation>(std::move(scene), std::move(options), viewer)) {}
Run::~Run() = default;
void Run::ask(std::string json) { implementation_->ask(std::move(json)); }
void Run::start() { implementation_->begin(); }
void Run::go(const std::function<bool()>& stop) { implementation_->go(stop); }
bool Run::busy() const { return implementation_->busy(); }

}  // namespace decant::live
