/// \file
/// `decant pour`: options, signals, and what is said in the end.
#include "oracle/audit.hpp"
#include "reference/error.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/backend_choice.hpp"
#include "tools/commands.hpp"
#include "tools/pour.hpp"
#include "tools/progress.hpp"
#include "tools/stop_signal.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <string>

namespace decant {
namespace {

struct PourArguments {
  BackendFlags flags;
  std::string scene, out, backend = "reference", executor = "auto";
  std::optional<std::int64_t> particles, frames;
  std::uint32_t perturbation = 0;
  bool csv = false, resume = false, quiet = false, json = false;
};

constexpr const char* footer =
    "Ctrl-C stops at the next frame and leaves a checkpoint; the same command with --resume goes "
    "on\n"
    "and ends in the same bits. A second Ctrl-C ends at once; the checkpoint before it still "
    "holds.\n"
    "Exit status 1 where mass does not add up or a particle passed a wall, 130 after Ctrl-C.\n"
    "\n"
    "Example:\n"
    "  decant pour fixtures/scenes/pour-4k.json --out build/pour-4k --frames 100";

Scene scene_of(const PourArguments& arguments) {
  const auto at_least_one = [](const char* option, std::int64_t value, std::int64_t most) {
    if (value < 1 || value > most)
      throw InputError("command line", option, std::to_string(value),
                       fmt::format("must be 1 … {}", most));
  };
  Scene scene = load_scene(arguments.scene);
  if (arguments.particles) {
    at_least_one("--particles", *arguments.particles, 1'000'000'000);
    scene = with_particles(scene, *arguments.particles);
  }
  if (arguments.frames) {
    at_least_one("--frames", *arguments.frames, 1'000'000);
    scene = with_frames(scene, static_cast<int>(*arguments.frames));
  }
  const auto warnings = check_scene(scene, arguments.scene);
  if (!arguments.quiet)
    for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  return scene;
}

nlohmann::ordered_json to_json(const PourResult& result, const BackendInfo& info,
                               const std::string& out) {
  const PourSummary& s = result.summary;
  nlohmann::ordered_json places, stages;
  for (std::size_t p = 0; p < place_names.size(); ++p)
    places[place_names[p]] = {{"mass_kg", s.mass_at[p]}, {"fraction", s.fraction_at[p]}};
  for (const StageName& stage : stage_names) {
    const StageTimes::Stage& time = result.timeline.stages.*stage.stage;
    stages[stage.name] = {{"seconds", time.seconds}, {"calls", time.calls}};
  }
  return {
      {"out", out},
      {"finished", result.finished},
      {"backend", info.name},
      {"options", info.options},
      {"executor", info.executor},
      {"device", info.device},
      {"precision", info.precision},
      {"particles", s.particles},
      {"frames", s.frames},
      {"substeps", s.substeps},
      {"mass_kg", s.mass},
      {"places", places},
      {"mass_adds_up", s.balanced()},
      {"unbalanced_frames", s.unbalanced_frames},
      {"penetrated", s.penetrated()},
      {"frames_inside_wall", s.frames_inside},
      {"wall_crossings", s.crossings},
      {"deepest_m", s.deepest},
      {"penetration_frame", s.penetration_frame},
      {"penetration_particle", s.penetration_particle},
      {"kinetic_energy_end_J", s.final_kinetic_energy},
      {"kinetic_energy_peak_J", s.peak_kinetic_energy},
      {"kinetic_energy_peak_s", s.peak_kinetic_time},
      {"max_speed_m_s", s.max_speed},
      {"max_density_kg_m3", s.max_density},
      {"solver_seconds", s.solver_seconds},
      {"wall_seconds", s.wall_seconds},
      {"substep_us", 1e6 * s.seconds_per_substep},
      {"stages", stages},
  };
}

void print(const PourResult& result, const BackendInfo& info, const Scene& scene) {
  const PourSummary& s = result.summary;
  fmt::print("{}: {} particles, {} frames, {} substeps of {:.3g} s; {} ({}) on {}\n", scene.name,
             s.particles, s.frames, s.substeps, scene.time_step(), info.name, info.precision,
             info.device);
  for (std::size_t p = 0; p < place_names.size(); ++p)
    fmt::print("  {:<10} {:9.3f} g {:7.2f} %\n", place_names[p], 1e3 * s.mass_at[p],
               1e2 * s.fraction_at[p]);
  fmt::print("  {:<10} {:9.3f} g, {}\n", "all", 1e3 * s.mass,
             s.balanced() ? "added up at every frame"
                          : fmt::format("DID NOT ADD UP at {} frames", s.unbalanced_frames));
  if (s.penetrated())
    fmt::print(
        "  walls      PENETRATED first at frame {} by particle {}; {} frames with particles "
        "inside a wall, {} crossings, deepest {:.3g} mm\n",
        s.penetration_frame, s.penetration_particle, s.frames_inside, s.crossings, 1e3 * s.deepest);
  else
    fmt::print("  walls      nothing inside a wall and nothing through one at any frame\n");
  fmt::print("  energy     kinetic {:.3g} J at the end, peak {:.3g} J at {:.3f} s\n",
             s.final_kinetic_energy, s.peak_kinetic_energy, s.peak_kinetic_time);
  fmt::print("  extremes   {:.3g} m/s, {:.1f} kg/m³\n", s.max_speed, s.max_density);
  fmt::print("  time       {} in all; solver {:.4g} µs a substep", duration_text(s.wall_seconds),
             1e6 * s.seconds_per_substep);
  for (const StageName& stage : stage_names)
    if (const StageTimes::Stage& time = result.timeline.stages.*stage.stage; time.calls > 0)
      fmt::print(", {} {:.4g}", stage.name, 1e6 * time.seconds / static_cast<double>(time.calls));
  fmt::print("\n");
}

int run(PourArguments& arguments) {
  const Scene scene = scene_of(arguments);
  const auto backend =
      choose_backend(arguments.flags.applied_to(arguments.backend), arguments.executor);
  arguments.flags.require_used();
  const StopSignal signal;
  PourOptions options;
  options.out = arguments.out;
  options.csv = arguments.csv;
  options.perturbation = arguments.perturbation;
  options.resume = arguments.resume;
  options.quiet = arguments.quiet;
  options.stop = [] { return StopSignal::caught() != 0; };
  const PourResult result = pour(scene, *backend, options);

  const BackendInfo info = backend->info();
  if (arguments.json) fmt::print("{}\n", to_json(result, info, arguments.out).dump(2));
  if (!result.finished) {
    if (!arguments.quiet)
      fmt::print(stderr, "stopped after frame {} of {}; the same command with --resume goes on\n",
                 result.frame, scene.schedule.frames);
    return 128 + StopSignal::caught();
  }
  if (!arguments.json && !arguments.quiet) print(result, info, scene);
  const bool conforms = result.summary.balanced() && !result.summary.penetrated();
  return conforms ? exit_pass : exit_does_not_conform;
}

}  // namespace

void add_pour_command(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand("pour", "run a scene; write frames, timeline, mass by place");
  auto a = std::make_shared<PourArguments>();
  command->add_option("SCENE", a->scene, "Scene file (JSON)")->required();
  command->add_option("--out", a->out, "Folder for frames.h5, *.xdmf, timeline.h5, csv/")
      ->required();
  command->add_option("--backend", a->backend, "reference, brute, …")
      ->capture_default_str();
  command->add_option("--executor", a->executor, "auto, cuda or host")->capture_default_str();
  a->flags.add_to(*command);
  command->add_option("--particles", a->particles,
                      "About this many; spacing and all that follows are derived anew");
  command->add_option("--frames", a->frames,
                      "Frames over the same time; the substep stays within its limits");
  command->add_option("--perturb", a->perturbation,
                      "Seed of a random change of the start in its last bits, for ensembles");
  command->add_flag("--csv", a->csv, "Also write csv/fluid_000123.csv and boundaries");
  command->add_flag("--resume", a->resume, "Go on from the folder's last checkpoint");
  command->add_flag("--quiet", a->quiet, "Say nothing but errors");
  command->add_flag("--json", a->json, "Print the summary as JSON");
  command->footer(footer);
  command->callback([a, &exit_status] { exit_status = run(*a); });
}

}  // namespace decant
