/// \file
/// The loop over frames, and what surrounds it.
#include "tools/pour/pour.hpp"

#include "oracle/files/file_aside.hpp"
#include "oracle/solution/digest.hpp"
#include "oracle/solution/fixture.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/clock.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/stop_watcher.hpp"
#include "tools/frames/csv_writer.hpp"
#include "tools/frames/vtkhdf_frames.hpp"
#include "tools/frames/xdmf.hpp"
#include "tools/pour/checkpoint.hpp"
#include "tools/pour/failed_state.hpp"
#include "tools/pour/folder_lock.hpp"
#include "tools/pour/frame_sampler.hpp"
#include "tools/pour/limits.hpp"
#include "tools/pour/pour_folder.hpp"
#include "tools/pour/segments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

namespace decant::pour {
namespace fs = std::filesystem;
namespace {

class Pour {
 public:
  Pour(const Scene& scene, Backend& backend, const Options& options)
      : scene_(scene),
        backend_(backend),
        options_(options),
        files_(options.out),
        segments_(scene),
        limits_(limits_of(scene)),
        info_(backend.info()) {
    if (options.stop && options.leave) watcher_.emplace(options.stop, [this] { leave(); });
  }

  Result run();

 private:
  void lock_folder();
  void start();
  void resume();
  void open_frames(bool anew);
  void end_frame(Fields fields);
  void next_segment();
  void tell(const TimelineRow& row);
  void tell_limits(const std::vector<TimelineRow>& rows);
  void checkpoint();
  void finish();
  Timeline timeline() const { return {samples_->rows(), stages_}; }
  Result result();
  void leave();
  void check(const Status& status, const ParticleState& good);
  [[noreturn]] void dump(const std::string& trouble, const ParticleState& good);
  double wall_seconds() const { return wall_before_ + seconds_since(started_); }
  std::int64_t done_in_frame() const { return state_->substep - frame_ * segments_.substeps(); }

  /// A call of the backend's, which a stop does not wait for.
  template <class Call>
  auto call(Call what) {
    return watcher_ ? watcher_->during(what) : what();
  }

  /// A call of the sampler's.
  template <class Call>
  void waiting(Call what) {
    const auto before = Clock::now();
    what();
    wait_seconds_ += seconds_since(before);
  }

  const Scene& scene_;
  Backend& backend_;
  const Options& options_;
  const Files files_;
  const Segments segments_;
  const SceneLimits limits_;
  const BackendInfo info_;
  std::optional<FolderLock> lock_;
  Walls walls_;
  frames::Layout layout_;
  SharedState state_;
  std::int64_t frame_ = 0;     // the last one that was reached
  double solver_seconds_ = 0;  // s, since then
  double fields_seconds_ = 0, wait_seconds_ = 0;
  StageTimes stages_, stages_before_;  // of all sessions; of those before this one
  double wall_before_ = 0;             // s
  Clock::time_point started_ = Clock::now(), saved_ = started_;
  double checkpoint_cost_ = 0;     // s, of the last one
  bool begun_ = false;             // a checkpoint of this state can be written
  std::vector<std::string> told_;  // limits that were passed
  std::optional<Progress> progress_;
  std::optional<frames::File> file_;
  std::optional<frames::CsvWriter> csv_;
  std::optional<FrameSampler> samples_;  // its thread uses the four above
  std::optional<StopWatcher> watcher_;   // last: its thread uses all of them
};

Result Pour::run() {
  if (fs::is_directory(options_.out)) lock_folder();
  check_folder(options_, files_);
  walls_ = call([&] { return sample_walls(scene_); });
  if (options_.resume) resume();
  else start();
  while (frame_ < scene_.schedule.frames && !(options_.stop && options_.stop())) {
    next_segment();
    // Checkpoints take at most a twentieth of the time.
    const double interval =
        options_.checkpoint_seconds > 0 ? std::max(options_.checkpoint_seconds, 20 * checkpoint_cost_) : 0.0;
    if (seconds_since(saved_) >= interval) checkpoint();
  }
  waiting([&] { samples_->drain(); });
  progress_->pause();
  if (frame_ == scene_.schedule.frames) finish();
  else checkpoint();
  Result r = result();
  r.ranks = backend_.neighbor_stats().ranks;
  return r;
}

Result Pour::result() {
  Result r;
  r.finished = frame_ == scene_.schedule.frames;
  r.frame = frame_;
  r.substep = state_->substep;
  r.fields_seconds = fields_seconds_;
  r.wait_seconds = wait_seconds_;
  r.timeline = timeline();
  r.summary = summarise(r.timeline, state_->size(), scene_.particle_mass());
  r.limits_exceeded = limits_exceeded(r.timeline.rows, limits_);
  return r;
}

/// By the watching thread, while the pouring one is in a call. The segment under way is lost.
void Pour::leave() {
  Result last;
  last.frame = options_.resume ? frame_ : -1;
  last.substep = state_ ? state_->substep : 0;
  try {
    if (begun_) {
      checkpoint();
      last = result();
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "decant: {}; the checkpoint before still holds\n", error.what());
    last.frame = frame_;
  }
  last.finished = false;
  options_.leave(last);
}

/// From here on no other pour changes the folder.
void Pour::lock_folder() {
  if (!lock_) lock_.emplace("--out", options_.out);
}

void Pour::start() {
  ParticleState first = call([&] { return initial_state(scene_); });
  if (options_.perturbation != 0) first = perturbed_start(first, options_.perturbation);
  state_ = std::make_shared<const ParticleState>(std::move(first));
  layout_ = frames::layout_of(scene_, state_->size());
  check_room(options_, files_, layout_, 0);
  fs::create_directories(options_.out);
  lock_folder();
  check_folder(options_, files_);  // another pour may have made and filled it meanwhile
  call([&] { backend_.load(scene_, walls_, *state_); });
  open_frames(true);
  Fields fields = Fields::unwritten(state_->size(), walls_.size());
  check(call([&] { return backend_.evaluate_density(fields); }), *state_);
  end_frame(std::move(fields));
  checkpoint();
  begun_ = true;
}

void Pour::resume() {
  Checkpoint from = read_checkpoint(files_.checkpoint);
  check_same_pour(files_.checkpoint, from, scene_, info_, {options_.csv, options_.perturbation});
  state_ = std::make_shared<const ParticleState>(std::move(from.state));
  frame_ = from.frame;
  if (const std::int64_t done = done_in_frame();
      done < 0 || (done > 0) != from.part.has_value() || done >= segments_.substeps() || !segments_.meet_at(done))
    throw InputError(files_.checkpoint.string(), "substep", std::to_string(state_->substep),
                     fmt::format("where a segment of frame {} ends", frame_ + 1));
  stages_ = stages_before_ = from.timeline.stages;
  wall_before_ = from.wall_seconds;
  layout_ = frames::layout_of(scene_, state_->size());
  // A pour killed among its last steps has its frames under their final name already.
  if (!fs::exists(files_.partial) && fs::exists(files_.frames)) fs::rename(files_.frames, files_.partial);
  check_room(options_, files_, layout_, frame_ + 1);
  call([&] { backend_.load(scene_, walls_, *state_); });
  open_frames(false);
  samples_->resume(state_, std::move(from.timeline.rows), from.part);
  if (from.part) solver_seconds_ = from.part->solver_seconds;
  begun_ = true;
  if (!options_.quiet)
    fmt::print(stderr, "resumes after frame {}{}\n", frame_,
               from.part ? fmt::format(", at substep {}", state_->substep) : "");
  if (!options_.quiet && from.backend.device != info_.device)
    fmt::print(stderr, "started on {}, resumes on {}: the last bits may differ\n", from.backend.device, info_.device);
  progress_->update(frame_);
  tell_limits(samples_->rows());
}

void Pour::open_frames(bool anew) {
  if (anew) {
    file_.emplace(frames::File::create(files_.partial, scene_, layout_,
                                       {{"scene_sha256", sha256_of_text(scene_to_json(scene_))},
                                        {"backend", info_.name},
                                        {"options", info_.options},
                                        {"executor", info_.executor},
                                        {"device", info_.device},
                                        {"precision", info_.precision},
                                        {"git_revision", build_provenance().at("git_revision")}}));
  } else {
    file_.emplace(frames::File::reopen(files_.partial, layout_));
  }
  if (options_.csv) csv_.emplace(files_.csv, scene_, layout_);
  progress_.emplace("frame", scene_.schedule.frames, frame_, options_.quiet);
  samples_.emplace(scene_, layout_,
                   FrameSampler::Outputs{[this](const frames::Frame& frame) {
                                           file_->write_values(frame);
                                           if (csv_) csv_->write(frame);
                                         },
                                         [this](const frames::Frame& frame) { file_->complete(frame); },
                                         [this](const TimelineRow& row) { tell(row); }});
}

/// Hands the frame that was reached to the sampler.
void Pour::end_frame(Fields fields) {
  try {
    require_finite(fields, state_->substep);
  } catch (const BackendError& trouble) {
    dump(trouble.what(), *state_);
  }
  const FrameTimes times{frame_, solver_seconds_, wall_seconds()};
  waiting([&] { samples_->end_of_frame(state_, std::move(fields), times); });
  // Its threads are as many as there are cores, and share a substep evenly: what delays one delays all.
  if (info_.executor == "host") waiting([&] { samples_->drain(); });
  solver_seconds_ = 0;
}

void Pour::next_segment() {
  const std::int64_t done = done_in_frame(), end = segments_.end_of(done), expected = state_->substep + end - done;
  const bool whole = end == segments_.substeps();
  double seconds = 0, reading = 0;
  auto next = std::make_shared<ParticleState>();
  Fields fields;
  if (whole) fields = samples_->unwritten(state_->size(), walls_.size());
  Status advanced, evaluated;
  bool next_finite = false;
  // What stands here stays as it was until all of it is done.
  call([&] {
    const auto before = Clock::now();
    advanced = backend_.advance(static_cast<int>(end - done));
    seconds = seconds_since(before);
    if (!advanced.ok()) return;
    backend_.read(*next);
    next_finite = all_finite(*next);
    if (whole && next_finite) evaluated = backend_.evaluate_density(fields);
    reading = seconds_since(before) - seconds;
  });
  check(advanced, *state_);
  if (next->substep != expected || next->size() != state_->size())
    throw BackendError(fmt::format("{}: {} particles at substep {} instead of {} at {}", info_.name, next->size(),
                                   next->substep, state_->size(), expected));
  if (!next_finite) check({Status::non_finite, -1, next->substep}, *state_);
  state_ = std::move(next);
  solver_seconds_ += seconds;
  fields_seconds_ += reading;
  stages_ = stages_before_ + backend_.stage_times();
  if (whole) {
    check(evaluated, *state_);
    ++frame_;
    end_frame(std::move(fields));
  } else if (segments_.samples_at(end)) {
    waiting([&] { samples_->within_frame(state_); });
  }
}

/// By the sampler's thread.
void Pour::tell(const TimelineRow& row) {
  progress_->update(row.frame, fmt::format("t = {:.3f} s, v <= {:.2f} m/s{}", row.time, row.max_speed,
                                           told_.empty() ? "" : ", BEYOND LIMITS"));
  tell_limits({row});
}

/// Once for each limit, when it is first passed.
void Pour::tell_limits(const std::vector<TimelineRow>& rows) {
  for (const LimitExceeded& e : limits_exceeded(rows, limits_)) {
    if (std::find(told_.begin(), told_.end(), e.limit) != told_.end()) continue;
    told_.push_back(e.limit);
    if (options_.quiet) continue;
    progress_->pause();
    fmt::print(stderr, "warning: {}\n", describe(e));
  }
}

void Pour::checkpoint() {
  const auto before = Clock::now();
  samples_->drain();
  file_->sync();
  Checkpoint now{
      frame_, *state_, timeline(), {}, {options_.csv, options_.perturbation}, wall_seconds(), scene_to_json(scene_),
      info_};
  if (done_in_frame() > 0) {
    now.part = samples_->part_of_frame();
    now.part->solver_seconds = solver_seconds_;
  }
  write_checkpoint(files_.checkpoint, now);
  saved_ = Clock::now();
  checkpoint_cost_ = std::chrono::duration<double>(saved_ - before).count();
}

void Pour::finish() {
  file_->sync();
  write_timeline(files_.timeline, timeline(), scene_to_json(scene_),
                 {{"backend", info_.name},
                  {"options", info_.options},
                  {"executor", info_.executor},
                  {"device", info_.device},
                  {"precision", info_.precision}});
  std::vector<double> times;
  for (const TimelineRow& row : samples_->rows()) times.push_back(row.time);
  fs::rename(files_.partial, files_.frames);
  const std::string data_file = files_.frames.filename().string();
  write_text_file(files_.frames_xdmf, frames::fluid_xdmf(layout_, times, data_file));
  write_text_file(files_.walls_xdmf, frames::walls_xdmf(layout_, times, data_file));
  frames::write_fluid_vtkhdf(files_.frames_vtkhdf, layout_, times, data_file);
  frames::write_walls_vtkhdf(files_.walls_vtkhdf, layout_, times, data_file);
  // Last, because its absence says that all of the above is complete.
  fs::remove(files_.checkpoint);
}

void Pour::check(const Status& status, const ParticleState& good) {
  if (!status.ok()) dump(describe(status), good);
}

void Pour::dump(const std::string& trouble, const ParticleState& good) {
  if (samples_) samples_->drain();
  throw BackendError(fmt::format("{} on {}: {}{}", info_.name, info_.executor, trouble,
                                 save_failed_state(files_.failed, scene_, good, info_, trouble)));
}

}  // namespace

Result run(const Scene& scene, Backend& backend, const Options& options) { return Pour(scene, backend, options).run(); }

}  // namespace decant::pour
