/// \file
/// The loop over frames, and what surrounds it.
#include "tools/pour.hpp"

#include "oracle/audit.hpp"
#include "oracle/conform.hpp"
#include "oracle/file_aside.hpp"
#include "oracle/fixture.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/checkpoint.hpp"
#include "tools/csv_writer.hpp"
#include "tools/frame_writer.hpp"
#include "tools/progress.hpp"
#include "tools/xdmf.hpp"

#include <fmt/format.h>

#include <sys/stat.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <utility>

namespace decant {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

// Particles; a larger state is dumped with a sample of the oracle's fields.
constexpr Eigen::Index largest_whole_dump = 16384;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The files of one output folder.
struct Files {
  explicit Files(const fs::path& folder)
      : frames(folder / "frames.h5"),
        partial(folder / "frames.h5.partial"),
        checkpoint(folder / "checkpoint.h5"),
        timeline(folder / "timeline.h5"),
        frames_xdmf(folder / "frames.xdmf"),
        walls_xdmf(folder / "walls.xdmf"),
        csv(folder / "csv"),
        failed(folder / "failed-state.h5") {}

  fs::path frames, partial, checkpoint, timeline, frames_xdmf, walls_xdmf, csv, failed;
};

/// Refuses a folder that a new pour would overwrite, or that has nothing to resume.
void check_folder(const PourOptions& options, const Files& files) {
  const auto refuse = [&](const char* option, const char* why) {
    throw InputError("command line", option, options.out.string(), why);
  };
  if (fs::exists(options.out) && !fs::is_directory(options.out))
    refuse("--out", "must be a folder");
  const bool unfinished = fs::exists(files.checkpoint);
  const bool complete = fs::exists(files.frames) && !unfinished;
  if (options.resume && complete)
    refuse("--resume", "holds a complete pour, nothing is left to do");
  if (options.resume && !unfinished) refuse("--resume", "holds no checkpoint.h5 to resume from");
  if (!options.resume && unfinished)
    refuse("--out", "holds an unfinished pour; add --resume, or name another folder");
  if (!options.resume && complete) refuse("--out", "holds a pour already; name another folder");
}

std::int64_t bytes_on_disk(const fs::path& file) {
  struct stat found {};
  return ::stat(file.c_str(), &found) == 0 ? std::int64_t{512} * found.st_blocks : 0;
}

std::string size_text(double bytes) {
  return bytes >= 1e9 ? fmt::format("{:.1f} GB", 1e-9 * bytes)
                      : fmt::format("{:.1f} MB", 1e-6 * bytes);
}

/// Compares what the pour still needs with what the disk has. Throws InputError where it is less.
void check_room(const PourOptions& options, const Files& files, const FrameLayout& layout,
                std::int64_t frames_done) {
  const double share = 1.0 - static_cast<double>(frames_done) / static_cast<double>(layout.frames);
  // Checkpoints: state in double, twice while one replaces the other. Per frame: XDMF and timeline.
  const std::int64_t beside = 2 * 48 * layout.particles + 4000 * layout.frames;
  const double needed =
      static_cast<double>(
          std::max<std::int64_t>(frame_file_bytes(layout) - bytes_on_disk(files.partial), 0) +
          beside) +
      (options.csv ? share * static_cast<double>(csv_bytes(layout)) : 0.0);
  fs::path there = fs::absolute(options.out);
  while (!fs::exists(there) && there.has_relative_path()) there = there.parent_path();
  const auto available = static_cast<double>(fs::space(there).available);
  if (!options.quiet)
    fmt::print(stderr, "disk: needs {}, {} free\n", size_text(needed), size_text(available));
  if (!(needed <= available))
    throw InputError("command line", "--out", options.out.string(),
                     fmt::format("needs {}, free are {}", size_text(needed), size_text(available)));
}

/// How often walls are looked at between two frames. Paths are followed as straight lines: what moves
/// further than two walls are thick, at the speed to expect, may turn on its way.
std::int64_t looks_per_frame(const Scene& scene) {
  double thinnest = INFINITY;
  for (const Container& container : scene.containers)
    thinnest = std::min(thinnest, container.wall_thickness);
  const double way = expected_max_speed(scene) * scene.time_step() *
                     static_cast<double>(scene.schedule.substeps_per_frame);
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(way / (2 * thinnest))), 1,
                                  scene.schedule.substeps_per_frame);
}

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

bool finite(const ParticleState& state) {
  return state.position.allFinite() && state.velocity.allFinite();
}

class Pour {
 public:
  Pour(const Scene& scene, Backend& backend, const PourOptions& options)
      : scene_(scene), backend_(backend), options_(options), files_(options.out), audit_(scene) {}

  PourResult run();

 private:
  void start();
  void resume();
  void open_frames(bool anew);
  void look(double solver_seconds, const AuditResult& on_the_way = {});
  void next_frame();
  void checkpoint();
  void finish();
  void check(const Status& status, const ParticleState& good);
  [[noreturn]] void dump(const std::string& trouble, const ParticleState& good);

  const Scene& scene_;
  Backend& backend_;
  const PourOptions& options_;
  const Files files_;
  Audit audit_;
  Walls walls_;
  FrameLayout layout_;
  ParticleState state_;
  std::int64_t frame_ = 0;
  Timeline timeline_;
  StageTimes stages_before_;  // of the sessions before this one
  double wall_before_ = 0;    // s
  Clock::time_point started_ = Clock::now(), saved_ = started_;
  double checkpoint_cost_ = 0;  // s, of the last one
  std::optional<FrameFile> file_;
  std::optional<CsvWriter> csv_;
  std::optional<FrameWriter> writer_;  // last: its thread uses the two above
};

PourResult Pour::run() {
  check_folder(options_, files_);
  walls_ = sample_walls(scene_);
  if (options_.resume)
    resume();
  else
    start();
  {
    Progress progress("frame", scene_.schedule.frames, frame_, options_.quiet);
    progress.update(frame_);
    while (frame_ < scene_.schedule.frames && !(options_.stop && options_.stop())) {
      next_frame();
      const TimelineRow& row = timeline_.rows.back();
      progress.update(frame_,
                      fmt::format("t = {:.3f} s, v <= {:.2f} m/s", row.time, row.max_speed));
      // Checkpoints take at most a twentieth of the time.
      const double interval = options_.checkpoint_seconds > 0
                                  ? std::max(options_.checkpoint_seconds, 20 * checkpoint_cost_)
                                  : 0.0;
      if (seconds_since(saved_) >= interval) checkpoint();
    }
  }
  PourResult result;
  result.finished = frame_ == scene_.schedule.frames;
  if (result.finished)
    finish();
  else
    checkpoint();
  result.frame = frame_;
  result.summary = summarise(timeline_, state_.size(), scene_.particle_mass());
  result.timeline = std::move(timeline_);
  return result;
}

void Pour::start() {
  state_ = initial_state(scene_);
  if (options_.perturbation != 0) state_ = disturbed_start(state_, options_.perturbation);
  layout_ = frame_layout(scene_, state_.size());
  check_room(options_, files_, layout_, 0);
  backend_.load(scene_, walls_, state_);
  fs::create_directories(options_.out);
  open_frames(true);
  look(0);
  checkpoint();
}

void Pour::resume() {
  Checkpoint from = read_checkpoint(files_.checkpoint);
  check_same_pour(files_.checkpoint, from, scene_, backend_.info(), options_.csv);
  state_ = std::move(from.state);
  frame_ = from.frame;
  timeline_ = std::move(from.timeline);
  stages_before_ = timeline_.stages;
  wall_before_ = timeline_.rows.back().wall_seconds;
  layout_ = frame_layout(scene_, state_.size());
  // A pour killed among its last steps has its frames under their final name already.
  if (!fs::exists(files_.partial) && fs::exists(files_.frames))
    fs::rename(files_.frames, files_.partial);
  check_room(options_, files_, layout_, frame_ + 1);
  backend_.load(scene_, walls_, state_);
  (void)audit_.look(state_);  // paths to the next frame start here
  open_frames(false);
  if (!options_.quiet) fmt::print(stderr, "resumes after frame {}\n", frame_);
  if (!options_.quiet && from.backend.device != backend_.info().device)
    fmt::print(stderr, "started on {}, resumes on {}: the last bits may differ\n",
               from.backend.device, backend_.info().device);
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
                                     {"precision", info.precision}}));
  } else {
    file_.emplace(FrameFile::reopen(files_.partial, layout_));
  }
  if (options_.csv) csv_.emplace(files_.csv, scene_, layout_);
  writer_.emplace([this](const Frame& frame) {
    file_->write(frame);
    if (csv_) csv_->write(frame);
  });
}

void Pour::look(double solver_seconds, const AuditResult& on_the_way) {
  Fields fields = Fields::unwritten(state_.size(), walls_.size());
  check(backend_.evaluate(fields), state_);
  AuditResult audit = audit_.look(state_);
  keep_worst(audit, on_the_way);
  TimelineRow row;
  try {
    row = timeline_row(frame_, scene_, state_, fields, audit);
  } catch (const BackendError& trouble) {
    dump(trouble.what(), state_);
  }
  row.solver_seconds = solver_seconds;
  row.wall_seconds = wall_before_ + seconds_since(started_);
  timeline_.rows.push_back(row);
  writer_->push(make_frame(scene_, layout_, frame_, state_, fields, audit));
}

void Pour::next_frame() {
  double solver_seconds = 0;
  AuditResult on_the_way;
  const std::int64_t all = scene_.schedule.substeps_per_frame, looks = looks_per_frame(scene_);
  for (std::int64_t k = 1; k <= looks; ++k) {
    const std::int64_t substeps = all * k / looks - all * (k - 1) / looks,
                       expected = state_.substep + substeps;
    const auto before = Clock::now();
    const Status status = backend_.advance(substeps);
    solver_seconds += seconds_since(before);
    check(status, state_);
    ParticleState next;
    backend_.read(next);
    if (next.substep != expected || next.size() != state_.size())
      throw BackendError(fmt::format("{}: {} particles at substep {} instead of {} at {}",
                                     backend_.info().name, next.size(), next.substep,
                                     state_.size(), expected));
    if (!finite(next)) check({Status::non_finite, -1, next.substep}, state_);
    state_ = std::move(next);
    if (k < looks) keep_worst(on_the_way, audit_.look(state_));
  }
  ++frame_;
  look(solver_seconds, on_the_way);
}

void Pour::checkpoint() {
  const auto before = Clock::now();
  writer_->drain();
  file_->sync();
  timeline_.stages = stages_before_ + backend_.stage_times();
  write_checkpoint(files_.checkpoint, {frame_, state_, timeline_, options_.csv,
                                       scene_to_json(scene_), backend_.info()});
  saved_ = Clock::now();
  checkpoint_cost_ = std::chrono::duration<double>(saved_ - before).count();
}

void Pour::finish() {
  writer_->drain();
  file_->sync();
  timeline_.stages = stages_before_ + backend_.stage_times();
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
  // Last, because its absence says that all of the above is complete.
  fs::remove(files_.checkpoint);
}

void Pour::check(const Status& status, const ParticleState& good) {
  if (!status.ok()) dump(describe(status), good);
}

void Pour::dump(const std::string& trouble, const ParticleState& good) {
  std::string where;
  try {
    const BackendInfo info = backend_.info();
    Fixture fixture;
    fixture.name = "failed-state";
    fixture.phase = "failed";
    fixture.scene = scene_;
    fixture.state = good;
    fixture.state.quantise();
    evaluate_oracle(scene_, fixture.state, fixture.fields.emplace(), fixture.condition.emplace());
    // A short one: whoever replays this state looks at what comes next.
    fixture.ensemble = run_ensemble(scene_, sample_walls(scene_), fixture.state, 4, 4);
    if (good.size() > largest_whole_dump) reduce_to_sample(fixture);
    fixture.provenance = {{"trouble", trouble},
                          {"backend", info.name},
                          {"options", info.options},
                          {"executor", info.executor},
                          {"device", info.device}};
    write_fixture(files_.failed, fixture);
    where = fmt::format("; the last good state, substep {}, is in {}", good.substep,
                        files_.failed.string());
  } catch (const std::exception& error) {
    where = fmt::format("; its state could not be saved: {}", error.what());
  }
  throw BackendError(fmt::format("{} on {}: {}{}", backend_.info().name, backend_.info().executor,
                                 trouble, where));
}

}  // namespace

ParticleState disturbed_start(ParticleState state, std::uint32_t seed) {
  std::mt19937 random(seed);
  for (double& x : state.position.reshaped())
    x *= 1 + 0x1p-22 * (2.0 * static_cast<double>(random()) / 4294967295.0 - 1);
  state.quantise();
  return state;
}

PourResult pour(const Scene& scene, Backend& backend, const PourOptions& options) {
  return Pour(scene, backend, options).run();
}

Scene with_frames(Scene scene, int frames) {
  const std::int64_t substeps =
      std::int64_t{scene.schedule.frames} * scene.schedule.substeps_per_frame;
  scene.schedule.frames = frames;
  scene.schedule.substeps_per_frame = scene.schedule.substeps_derived
                                          ? substeps_for(scene)
                                          : static_cast<int>((substeps + frames - 1) / frames);
  return scene;
}

}  // namespace decant
