/// \file
/// The solver's loop: what was asked, as many substeps as there is time for until a picture is due, the picture. What
/// a picture is made of is read by the loop; colors, bytes and figures are made beside it.
#include "tools/live/run_implementation.hpp"
#include "tools/pour/timeline.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <limits>

namespace decant::live {
namespace {

// Of the time, what pictures may take; but more than five a second there are where they can be made.
constexpr double share_of_pictures = 0.07, slowest_interval = 0.15;
// s, between two figures of the status.
constexpr double status_interval = 0.25;

using pour::operator-;

/// N of lists rebuilt every N substeps; else 1.
std::int64_t rebuild_interval(const std::string& choice) {
  const auto at = choice.find(":rebuild=");
  return at == choice.npos ? 1 : std::max(1L, std::atol(choice.c_str() + at + 9));
}

/// A mean in which the last few count most.
void follow(double& mean, double value) { mean = mean > 0 ? 0.8 * mean + 0.2 * value : value; }

}  // namespace

void Run::Implementation::go(const std::function<bool()>& stop) {
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

void Run::Implementation::rest(double seconds) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return !asked_.empty(); });
}

double Run::Implementation::interval() const {
  return std::clamp(picture_cost_ / share_of_pictures, 1 / options_.pictures_per_second, slowest_interval);
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
