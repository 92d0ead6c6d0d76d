/// \file
/// `decant bench`: what a substep costs each backend at recorded states. What does not conform is
/// not timed.
#include "gpu/backends.hpp"
#include "oracle/checks/conform.hpp"
#include "oracle/files/file_aside.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/report/console_table.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/bench_rows.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/fixture_folder.hpp"
#include "tools/commands/interruptible.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/commands/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace decant {
namespace {

struct BenchArguments {
  BackendFlags flags;
  std::vector<std::string> fixtures, backends, reports;
  std::string executor = "auto";
  bool json = false, profile = false, profile_child = false;
  int substeps = 0, windows = 5, refine = 0;
};

constexpr const char* bench_footer =
    "Each window starts from the recorded state again, advances it by a frame to warm up, and then by\n"
    "--substeps, a frame's worth at a time as `pour` does. The median window counts. Where substeps\n"
    "are launched one by one stages are sampled and launch apart, so that their sum may exceed a substep\n"
    "of a small scene; where many are one launch it tells their times, integration with forces.\n"
    "Interactions are fluid and wall neighbors at the recorded state. A backend that fails a check on\n"
    "the recording is not timed. --refine K makes eight particles of each, K times, and lets the first\n"
    "backend that conforms settle them for a while: sizes that no recording has. The recording is what\n"
    "is judged.\n"
    "--profile runs ncu on this command, plug-ins included, and tells the last launch of each kernel in two\n"
    "calls of one substep. Every launch is repeated for each group of counters. A persistent kernel is one\n"
    "launch; list:launch=stream and hash:launch=stream show its parts.\n"
    "Exit status: 0 timed, 1 something does not conform, 2 bad input, 3 a backend failed,\n"
    "77 the device of --executor is absent, 130 after Ctrl-C (143: SIGTERM): what was timed by then is kept.\n"
    "\n"
    "Examples:\n"
    "  decant bench --backend brute,hash,list --executor cuda \\\n"
    "    --report build/bench.json\n"
    "  decant bench pour-4k-stream --backend hash,hash:sort=thrust,list:skin=0.1\n"
    "  decant bench pour-4k-stream --backend list,plugin:./mine.so --profile";

// Seconds that a window takes, about, where --substeps leaves it open.
constexpr double usual_window = 0.1;

struct Window {
  double seconds = 0;
  std::int64_t substeps = 0, rebuilds = 0;
  StageTimes stages;
};

void require_ok(const Backend& backend, const Status& status) {
  if (!status.ok()) throw BackendError(backend.info().name + ": " + describe(status));
}

Window run_window(Backend& backend, const Fixture& fixture, const Walls& walls, int substeps) {
  using Clock = std::chrono::steady_clock;
  const int frame = fixture.scene.schedule.substeps_per_frame;
  backend.load(fixture.scene, walls, fixture.state);
  // The first advance may allocate and record; the second shows what a substep takes.
  require_ok(backend, backend.advance(2));
  auto start = Clock::now();
  const int trial = substeps > 0 ? std::min(substeps, frame) : 2;
  require_ok(backend, backend.advance(trial));
  const double each = std::chrono::duration<double>(Clock::now() - start).count() / trial;
  if (substeps == 0) {
    const double wanted = std::clamp(usual_window / each, 2.0, 100.0 * frame);
    substeps = wanted > frame ? static_cast<int>(wanted / frame) * frame : static_cast<int>(wanted);
    if (substeps >= frame) require_ok(backend, backend.advance(frame));
  }
  const std::int64_t rebuilds_before = backend.neighbor_stats().rebuilds;
  start = Clock::now();
  for (int done = 0; done < substeps; done += frame)
    require_ok(backend, backend.advance(std::min(frame, substeps - done)));
  Window window;
  window.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  window.substeps = substeps;
  window.rebuilds = backend.neighbor_stats().rebuilds - rebuilds_before;
  window.stages = backend.stage_times();
  return window;
}

// Substeps after which new particles are brought back to the speed they were made with, and how often:
// what they gain in the meantime is the fall from places that were too close.
constexpr int settling = 8, settlings = 12;

/// Eight particles for one, at half the spacing, moved on by the backend until they have found their
/// places, and then for a frame.
Fixture refined(Backend& backend, Fixture fixture, int times) {
  for (int t = 0; t < times; ++t) {
    const double quarter = fixture.scene.particle_spacing / 4;
    const auto n = fixture.state.size();
    ParticleState fine;
    fine.position.resize(3, 8 * n);
    fine.velocity.resize(3, 8 * n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (int k = 0; k < 8; ++k) {
        const Vec3 side(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
        fine.position.col(8 * i + k) = fixture.state.position.col(i) + quarter * side;
        fine.velocity.col(8 * i + k) = fixture.state.velocity.col(i);
      }
    const double time = fixture.scene.time_at(fixture.state.substep);
    fixture.scene = with_particles(fixture.scene, 8 * n);
    fixture.scene.particle_spacing = 2 * quarter;
    fine.substep = std::llround(time / fixture.scene.time_step());
    fine.quantise();
    const Walls walls = sample_walls(fixture.scene);
    const Eigen::Matrix3Xd velocity = fine.velocity;
    for (int k = 0; k < settlings; ++k) {
      backend.load(fixture.scene, walls, fine);
      require_ok(backend, backend.advance(settling));
      backend.read(fine);
      fine.velocity = velocity;
    }
    backend.load(fixture.scene, walls, fine);
    require_ok(backend, backend.advance(fixture.scene.schedule.substeps_per_frame));
    backend.read(fixture.state);
  }
  return fixture;
}

/// A stage's time in µs each time it runs.
double each_us(const StageTimes::Stage& stage) {
  return stage.calls > 0 ? 1e6 * stage.seconds / static_cast<double>(stage.calls) : 0;
}

/// What a backend must pass before it is timed. A list that may miss pairs after some substeps is timed
/// all the same: its error is the other half of that trade.
CheckSelection timed_checks() { return {"fields", "substep"}; }

/// Why the backend must not be timed; empty where it conforms.
std::string objection(Backend& backend, const Fixture& fixture, const PreparedReference& oracle) {
  for (const CheckRow& row : run_checks(backend, fixture, oracle, timed_checks()))
    if (verdict_of(row) != Verdict::pass)
      return fmt::format("{} {} of {}: {}", row.check, row.field, fixture.name,
                         row.reason.empty() ? fmt::format("score {:.3g}", row.score) : row.reason);
  return {};
}

BenchRow time_backend(Backend& backend, const Fixture& fixture, const Walls& walls, const BenchArguments& arguments) {
  std::vector<Window> windows;
  for (int w = 0; w < arguments.windows; ++w)
    windows.push_back(run_window(backend, fixture, walls, arguments.substeps));
  const auto substep_us = [](const Window& w) { return 1e6 * w.seconds / static_cast<double>(w.substeps); };
  std::sort(windows.begin(), windows.end(),
            [&](const Window& a, const Window& b) { return substep_us(a) < substep_us(b); });
  const Window& middle = windows[windows.size() / 2];
  const BackendInfo info = backend.info();
  BenchRow row;
  row.backend = info.name;
  row.options = info.options;
  row.executor = info.executor;
  row.device = info.device;
  row.window = fixture.phase;
  row.particles = fixture.state.size();
  row.wall_particles = walls.size();
  row.substeps = middle.substeps;
  row.substep_us = substep_us(middle);
  row.fastest_us = substep_us(windows.front());
  row.slowest_us = substep_us(windows.back());
  row.conformant = true;

  const StageTimes& s = middle.stages;
  row.tells_stages = s.force.calls > 0;
  // Not every substep of a list builds.
  const double substeps = static_cast<double>(middle.substeps);
  const double builds = middle.rebuilds > 0 ? static_cast<double>(middle.rebuilds) / substeps : 1;
  row.stages_us = {builds * each_us(s.build), each_us(s.density), each_us(s.force), each_us(s.integrate), 0};
  double named = 0;
  for (const double stage : row.stages_us) named += stage;
  row.stages_us.back() = std::max(0.0, row.substep_us - named);
  if (middle.rebuilds > 0) row.substeps_per_rebuild = 1 / builds;

  backend.load(fixture.scene, walls, fixture.state);
  Fields fields = Fields::unwritten(fixture.state.size(), walls.size());
  require_ok(backend, backend.evaluate(fields));
  row.neighbors_mean =
      fields.fluid_neighbor_count.cast<double>().mean() + fields.wall_neighbor_count.cast<double>().mean();
  row.device_bytes_per_particle =
      static_cast<double>(backend.neighbor_stats().device_bytes) / static_cast<double>(fixture.state.size());
  return row;
}

/// What ncu looks at.
int be_profiled(const BenchArguments& arguments) {
  const auto backend = choose_backend(arguments.backends.at(0), arguments.executor);
  const Fixture fixture = read_fixture(recording_called(arguments.fixtures.at(0)));
  backend->load(fixture.scene, sample_walls(fixture.scene), fixture.state);
  start_profiler();
  for (const int substeps : profile::calls) require_ok(*backend, backend->advance(substeps));
  return exit_pass;
}

/// Kernels of every backend on every recording, by their counters.
int bench_counters(BenchArguments& arguments) {
  if (arguments.substeps > 0 || arguments.refine > 0 || !arguments.reports.empty())
    throw InputError("command line", "--profile", "given", "without --substeps, --refine and --report");
  std::vector<std::string> names = arguments.backends;
  if (names.empty()) {
    names = backend_choices();
    std::erase(names, "reference");
  }
  for (std::string& name : names) {
    name = arguments.flags.applied_to(name);
    require_offers(*choose_backend(name, arguments.executor), name, "bench");
  }
  arguments.flags.require_used();
  if (arguments.fixtures.empty())
    throw InputError("command line", "FIXTURE", "none", "the recording to profile on, as pour-4k-stream");
  std::string separator = "[";
  for (const std::string& given : arguments.fixtures) {
    const std::string file = recording_called(given).string();
    for (const std::string& name : names) {
      const auto kernels = profile::of_backend(file, name, arguments.executor);
      const std::string recording = std::filesystem::path(file).stem().string();
      if (arguments.json) fmt::print("{}{}", std::exchange(separator, ",\n"), profile::json(recording, name, kernels));
      else fmt::print("{} on {}, the last launch of each kernel\n{}\n", name, recording, profile::table(kernels));
      std::fflush(stdout);
    }
  }
  if (arguments.json) fmt::print("]\n");
  return exit_pass;
}

int bench(BenchArguments& arguments) {
  if (arguments.profile_child) return be_profiled(arguments);
  if (arguments.profile) return bench_counters(arguments);
  for (const std::string& report : arguments.reports) check_output_place("--report", report);
  std::vector<std::unique_ptr<Backend>> backends;
  auto names = arguments.backends;
  if (names.empty()) {
    names = backend_choices();
    if (arguments.executor == "cuda") std::erase(names, "reference");
  }
  for (const auto& name : names) {
    backends.push_back(choose_backend(arguments.flags.applied_to(name), arguments.executor));
    require_offers(*backends.back(), name, "bench");
  }
  arguments.flags.require_used();
  std::vector<std::filesystem::path> files;
  for (const auto& given : arguments.fixtures) files.push_back(recording_called(given));
  if (files.empty()) files = fixtures_in(fixture_folder(), false);

  std::vector<BenchRow> rows;
  std::int64_t done = 0;
  const auto all = static_cast<std::int64_t>(files.size() * backends.size());
  const auto write = [&](const std::string& interrupted) {
    if (arguments.json) fmt::print("{}", bench_json(rows, interrupted));
    std::fflush(stdout);
    for (const std::string& report : arguments.reports)
      if (report.ends_with(".json")) write_text_file(report, bench_json(rows, interrupted));
      else write_bench_hdf5(report, rows, interrupted);
  };
  const auto tell = [&](const std::string& line) {
    fmt::print(arguments.json ? stderr : stdout, "{}\n", line);
    std::fflush(stdout);
  };
  Interruptible work([&] {
    const std::string line = interrupted_line(done, all, "timed or refused");
    tell(line);
    write(line);
  });
  tell(bench_heading());
  int status = exit_pass;
  for (const auto& file : files) {
    const Fixture fixture = read_fixture(file);
    PreparedReference oracle;
    work.part([&] { oracle = prepare_reference(fixture, timed_checks()); });
    std::optional<Fixture> fine;  // made by the first backend that conforms, timed by all
    Walls fine_walls;
    for (const auto& backend : backends) {
      const BackendInfo info = backend->info();
      const std::string label = backend_label(info.name, info.options);
      std::string why;
      work.part([&] { why = objection(*backend, fixture, oracle); });
      if (!why.empty()) {
        tell(fmt::format("{:<28} does not conform, is not timed: {}", label, why));
        status = exit_does_not_conform;
        ++done;
        continue;
      }
      try {
        BenchRow row;
        work.part([&] {
          if (arguments.refine > 0 && !fine) {
            fine = refined(*backend, fixture, arguments.refine);
            fine_walls = sample_walls(fine->scene);
          }
          row = fine ? time_backend(*backend, *fine, fine_walls, arguments)
                     : time_backend(*backend, fixture, oracle.walls, arguments);
        });
        rows.push_back(std::move(row));
      } catch (const BackendError& error) {
        tell(fmt::format("{:<28} breaks down, is not timed: {}", label, error.what()));
        status = exit_failure;
        ++done;
        continue;
      }
      ++done;
      tell(to_text(rows.back()));
    }
  }
  write("");
  return status;
}

}  // namespace

void add_bench_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<BenchArguments>();
  CLI::App* verb = app.add_subcommand("bench", "time per substep of backends that conform");
  verb->footer(bench_footer);
  verb->add_option("FIXTURE", arguments->fixtures, "recordings (*.h5); default: the small ones");
  verb->add_option(
          "--backend", arguments->backends,
          "reference,reference:all-pairs,brute,…, plugin:PATH, python:FILE:CLASS; default: all that the executor runs")
      ->delimiter(',')
      ->allow_extra_args(false);
  verb->add_option("--executor", arguments->executor, "auto, cuda or host")->capture_default_str();
  arguments->flags.add_to(*verb);
  verb->add_option("--substeps", arguments->substeps,
                   "substeps in a window; default: as many as take a tenth of a second")
      ->check(CLI::Range(1, 1000000));
  verb->add_option("--windows", arguments->windows, "windows to take the median of")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->add_option("--refine", arguments->refine, "eight particles for one, so many times")->check(CLI::Range(0, 4));
  verb->add_flag("--profile", arguments->profile,
                 "in place of times what the GPU's counters say of each kernel, by Nsight Compute (ncu)");
  verb->add_flag("--profile-child", arguments->profile_child)->group("");
  verb->add_flag("--json", arguments->json, "rows as JSON instead of the table");
  verb->add_option("--report", arguments->reports, "write rows: as JSON where the name ends in .json, else as HDF5")
      ->allow_extra_args(false);
  verb->callback([arguments, &exit_status] { exit_status = bench(*arguments); });
}

}  // namespace decant
