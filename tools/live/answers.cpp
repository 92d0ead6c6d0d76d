/// \file
/// What a page asks, and what becomes of the run: other values, another scene or backend, a hand, a recording. What is
/// refused leaves all as it was.
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "tools/live/keep.hpp"
#include "tools/live/run_implementation.hpp"
#include "tools/pour/timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>

namespace decant::live {
namespace {

Quantity quantity_of(const std::string& name) {
  const auto found = std::ranges::find(quantity_names, name);
  if (found == quantity_names.end())
    throw InputError("page", "color", name, "speed, density, pressure, region or score");
  return static_cast<Quantity>(found - quantity_names.begin());
}

}  // namespace

void Run::Implementation::ask(std::string json) {
  const std::lock_guard lock(mutex_);
  asked_.push_back(std::move(json));
  wake_.notify_all();
}

void Run::Implementation::begin() {
  choice_ = options_.backend;
  backend_ = options_.make_backend(choice_);
  start();
}

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
  if (!failed_.empty() || !pour::all_finite(state)) return *last_;
  state.substep = substep_;
  return state;
}

void Run::Implementation::tell_scene() {
  viewer_.tell(scene_message(scene_, last_->size(), walls_.size(), backend_->info(), choice_, options_.backends));
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

}  // namespace decant::live
