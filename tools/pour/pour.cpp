/// \file
/// The loop over frames, and what surrounds it.
#include "tools/pour/pour.hpp"

#include "oracle/checks/audit.hpp"
#include "oracle/files/file_aside.hpp"
#include "oracle/solution/digest.hpp"
#include "oracle/solution/fixture.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/stop_watcher.hpp"
#include "tools/frames/csv_writer.hpp"
#include "tools/frames/frame_writer.hpp"
#include "tools/frames/vtkhdf_frames.hpp"
#include "tools/frames/xdmf.hpp"
#include "tools/pour/checkpoint.hpp"
#include "tools/pour/failed_state.hpp"
#include "tools/pour/folder_lock.hpp"
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

namespace decant {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// What a look at walls found, joined to what another one found.
void keep_worst(AuditResult& all, const AuditResult& one) {
  if (one.deepest > all.deepest) {
    all.deepest = one.deepest;
    all.deepest_particle = one.deepest_particle;
  }
  all.inside = std::max(all.inside, one.inside);
  all.crossed += one.crossed;
  if (all.first_crossed < 0) all.first_crossed = one.first_crossed;
  all.max_speed = std::max(all.max_speed, one.max_speed);
}

std::int64_t fastest_in(const ParticleState& state) {
  Eigen::Index fastest = -1;
  if (state.size() > 0) state.velocity.colwise().squaredNorm().maxCoeff(&fastest);
  return fastest;
}

bool finite(const ParticleState& state) { return state.position.allFinite() && state.velocity.allFinite(); }

class Pour {
 public:
  Pour(const Scene& scene, Backend& backend, const PourOptions& options)
      : scene_(scene),
        backend_(backend),
        options_(options),
        files_(options.out),
        segments_(scene),
        limits_(limits_of(scene)),
        audit_(scene) {
    if (options.stop && options.leave) watcher_.emplace(options.stop, [this] { leave(); });
  }

  PourResult run();

 private:
  void lock_folder();
  void start();
  void resume();
  void open_frames(bool anew);
  void sample(const Fields& fields);
  bool next_segment();
  void tell_limits();
  void checkpoint();
  void finish();
  PourResult result();
  void leave();
  void check(const Status& status, const ParticleState& good);
  [[noreturn]] void dump(const std::string& trouble, const ParticleState& good);
  double wall_seconds() const { return wall_before_ + seconds_since(started_); }
  std::int64_t done_in_frame() const { return state_.substep - frame_ * segments_.substeps(); }

  /// A call of the backend's, which a stop does not wait for.
  template <class Call>
  auto call(Call what) {
    return watcher_ ? watcher_->during(what) : what();
  }

  const Scene& scene_;
  Backend& backend_;
  const PourOptions& options_;
  const PourFiles files_;
  const Segments segments_;
  const SceneLimits limits_;
  std::optional<FolderLock> lock_;
  Audit audit_;
  Walls walls_;
  FrameLayout layout_;
  ParticleState state_;
  std::int64_t frame_ = 0;  // the last one written
  PartOfFrame part_;        // of the frame under way
  Timeline timeline_;
  StageTimes stages_before_;  // of the sessions before this one
  double wall_before_ = 0;    // s
  Clock::time_point started_ = Clock::now(), saved_ = started_;
  double checkpoint_cost_ = 0;     // s, of the last one
  bool begun_ = false;             // a checkpoint of this state can be written
  std::vector<std::string> told_;  // limits that were passed
  std::optional<Progress> progress_;
  std::optional<FrameFile> file_;
  std::optional<CsvWriter> csv_;
  std::optional<FrameWriter> writer_;   // its thread uses the two above
  std::optional<StopWatcher> watcher_;  // last: its thread uses all of them
};

PourResult Pour::run() {
  if (fs::is_directory(options_.out)) lock_folder();
  check_pour_folder(options_, files_);
  walls_ = call([&] { return sample_walls(scene_); });
  if (options_.resume) resume();
  else start();
  progress_.emplace("frame", scene_.schedule.frames, frame_, options_.quiet);
  progress_->update(frame_);
  tell_limits();
  while (frame_ < scene_.schedule.frames && !(options_.stop && options_.stop())) {
    if (next_segment()) {
      const TimelineRow& row = timeline_.rows.back();
      progress_->update(frame_, fmt::format("t = {:.3f} s, v <= {:.2f} m/s{}", row.time, row.max_speed,
                                            told_.empty() ? "" : ", BEYOND LIMITS"));
      tell_limits();
    }
    // Checkpoints take at most a twentieth of the time.
    const double interval =
        options_.checkpoint_seconds > 0 ? std::max(options_.checkpoint_seconds, 20 * checkpoint_cost_) : 0.0;
    if (seconds_since(saved_) >= interval) checkpoint();
  }
  progress_->pause();
  if (frame_ == scene_.schedule.frames) finish();
  else checkpoint();
  return result();
}

PourResult Pour::result() {
  PourResult r;
  r.finished = frame_ == scene_.schedule.frames;
  r.frame = frame_;
  r.substep = state_.substep;
  r.summary = summarise(timeline_, state_.size(), scene_.particle_mass());
  r.limits_exceeded = limits_exceeded(timeline_.rows, limits_);
  r.timeline = timeline_;
  return r;
}

/// By the watching thread, while the pouring one is in a call. The segment under way is lost.
void Pour::leave() {
  PourResult last;
  last.frame = options_.resume ? frame_ : -1;
  last.substep = state_.substep;
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
  state_ = call([&] { return initial_state(scene_); });
  if (options_.perturbation != 0) state_ = perturbed_start(state_, options_.perturbation);
  layout_ = frame_layout(scene_, state_.size());
  check_room(options_, files_, layout_, 0);
  fs::create_directories(options_.out);
  lock_folder();
  check_pour_folder(options_, files_);  // another pour may have made and filled it meanwhile
  call([&] { backend_.load(scene_, walls_, state_); });
  open_frames(true);
  Fields fields = Fields::unwritten(state_.size(), walls_.size());
  check(call([&] { return backend_.evaluate(fields); }), state_);
  sample(fields);
  checkpoint();
  begun_ = true;
}

void Pour::resume() {
  Checkpoint from = read_checkpoint(files_.checkpoint);
  check_same_pour(files_.checkpoint, from, scene_, backend_.info(), {options_.csv, options_.perturbation});
  state_ = std::move(from.state);
  frame_ = from.frame;
  if (const std::int64_t done = done_in_frame();
      done < 0 || (done > 0) != from.part.has_value() || done >= segments_.substeps() || !segments_.meet_at(done))
    throw InputError(files_.checkpoint.string(), "substep", std::to_string(state_.substep),
                     fmt::format("where a segment of frame {} ends", frame_ + 1));
  timeline_ = std::move(from.timeline);
  stages_before_ = timeline_.stages;
  wall_before_ = from.wall_seconds;
  layout_ = frame_layout(scene_, state_.size());
  // A pour killed among its last steps has its frames under their final name already.
  if (!fs::exists(files_.partial) && fs::exists(files_.frames)) fs::rename(files_.frames, files_.partial);
  check_room(options_, files_, layout_, frame_ + 1);
  call([&] { backend_.load(scene_, walls_, state_); });
  // Paths to the next look start at the last one.
  if (from.part) part_ = std::move(*from.part);
  ParticleState sampled = state_;
  if (from.part) {
    sampled.substep = part_.looked_at_substep;
    sampled.position = part_.looked_at;
  }
  (void)audit_.sample(sampled);
  open_frames(false);
  begun_ = true;
  if (!options_.quiet)
    fmt::print(stderr, "resumes after frame {}{}\n", frame_,
               from.part ? fmt::format(", at substep {}", state_.substep) : "");
  if (!options_.quiet && from.backend.device != backend_.info().device)
    fmt::print(stderr, "started on {}, resumes on {}: the last bits may differ\n", from.backend.device,
               backend_.info().device);
}

void Pour::open_frames(bool anew) {
  if (anew) {
    const BackendInfo info = backend_.info();
    file_.emplace(FrameFile::create(files_.partial, scene_, layout_,
                                    {{"scene_sha256", sha256_of_text(scene_to_json(scene_))},
                                     {"backend", info.name},
                                     {"options", info.options},
                                     {"executor", info.executor},
                                     {"device", info.device},
                                     {"precision", info.precision},
                                     {"git_revision", build_provenance().at("git_revision")}}));
  } else {
    file_.emplace(FrameFile::reopen(files_.partial, layout_));
  }
  if (options_.csv) csv_.emplace(files_.csv, scene_, layout_);
  writer_.emplace([this](const Frame& frame) {
    file_->write(frame);
    if (csv_) csv_->write(frame);
  });
}

/// What there is to say of the frame that was reached.
void Pour::sample(const Fields& fields) {
  AuditResult audit = audit_.sample(state_);
  const bool fastest_now = audit.max_speed >= part_.on_the_way.max_speed;
  keep_worst(audit, part_.on_the_way);
  TimelineRow row;
  try {
    row = timeline_row(frame_, scene_, state_, fields, audit);
  } catch (const BackendError& trouble) {
    dump(trouble.what(), state_);
  }
  row.fastest_particle = fastest_now ? fastest_in(state_) : part_.fastest_particle;
  row.solver_seconds = part_.solver_seconds;
  row.wall_seconds = wall_seconds();
  timeline_.rows.push_back(row);
  writer_->push(make_frame(scene_, layout_, frame_, state_, fields, audit));
  part_ = {};
}

/// Whether it ended a frame.
bool Pour::next_segment() {
  const std::int64_t done = done_in_frame(), end = segments_.end_of(done), expected = state_.substep + end - done;
  if (done == 0) {
    part_.looked_at = state_.position;
    part_.looked_at_substep = state_.substep;
  }
  const bool whole = end == segments_.substeps();
  double seconds = 0;
  ParticleState next;
  Fields fields;
  if (whole) fields = Fields::unwritten(state_.size(), walls_.size());
  Status advanced, evaluated;
  // What stands here stays as it was until all of it is done.
  call([&] {
    const auto before = Clock::now();
    advanced = backend_.advance(static_cast<int>(end - done));
    seconds = seconds_since(before);
    if (!advanced.ok()) return;
    backend_.read(next);
    if (whole && finite(next)) evaluated = backend_.evaluate(fields);
  });
  check(advanced, state_);
  if (next.substep != expected || next.size() != state_.size())
    throw BackendError(fmt::format("{}: {} particles at substep {} instead of {} at {}", backend_.info().name,
                                   next.size(), next.substep, state_.size(), expected));
  if (!finite(next)) check({Status::non_finite, -1, next.substep}, state_);
  state_ = std::move(next);
  part_.solver_seconds += seconds;
  timeline_.stages = stages_before_ + backend_.stage_times();
  if (whole) {
    check(evaluated, state_);
    ++frame_;
    sample(fields);
    return true;
  }
  if (segments_.samples_at(end)) {
    const AuditResult seen = audit_.sample(state_);
    if (seen.max_speed > part_.on_the_way.max_speed) part_.fastest_particle = fastest_in(state_);
    keep_worst(part_.on_the_way, seen);
    part_.looked_at = state_.position;
    part_.looked_at_substep = state_.substep;
  }
  return false;
}

/// Once for each limit, when it is first passed.
void Pour::tell_limits() {
  for (const LimitExceeded& e : limits_exceeded(timeline_.rows, limits_)) {
    if (std::find(told_.begin(), told_.end(), e.limit) != told_.end()) continue;
    told_.push_back(e.limit);
    if (options_.quiet) continue;
    progress_->pause();
    fmt::print(stderr, "warning: {}\n", describe(e));
  }
}

void Pour::checkpoint() {
  const auto before = Clock::now();
  writer_->drain();
  file_->sync();
  Checkpoint now{frame_,
                 state_,
                 timeline_,
                 {},
                 {options_.csv, options_.perturbation},
                 wall_seconds(),
                 scene_to_json(scene_),
                 backend_.info()};
  if (done_in_frame() > 0) now.part = part_;
  write_checkpoint(files_.checkpoint, now);
  saved_ = Clock::now();
  checkpoint_cost_ = std::chrono::duration<double>(saved_ - before).count();
}

void Pour::finish() {
  writer_->drain();
  file_->sync();
  const BackendInfo info = backend_.info();
  write_timeline(files_.timeline, timeline_, scene_to_json(scene_),
                 {{"backend", info.name},
                  {"options", info.options},
                  {"executor", info.executor},
                  {"device", info.device},
                  {"precision", info.precision}});
  std::vector<double> times;
  for (const TimelineRow& row : timeline_.rows) times.push_back(row.time);
  fs::rename(files_.partial, files_.frames);
  const std::string data_file = files_.frames.filename().string();
  write_text_file(files_.frames_xdmf, frames_xdmf(layout_, times, data_file));
  write_text_file(files_.walls_xdmf, walls_xdmf(layout_, times, data_file));
  write_frames_vtkhdf(files_.frames_vtkhdf, layout_, times, data_file);
  write_walls_vtkhdf(files_.walls_vtkhdf, layout_, times, data_file);
  // Last, because its absence says that all of the above is complete.
  fs::remove(files_.checkpoint);
}

void Pour::check(const Status& status, const ParticleState& good) {
  if (!status.ok()) dump(describe(status), good);
}

void Pour::dump(const std::string& trouble, const ParticleState& good) {
  throw BackendError(fmt::format("{} on {}: {}{}", backend_.info().name, backend_.info().executor, trouble,
                                 save_failed_state(files_.failed, scene_, good, backend_.info(), trouble)));
}

}  // namespace

PourResult pour(const Scene& scene, Backend& backend, const PourOptions& options) {
  return Pour(scene, backend, options).run();
}

}  // namespace decant
