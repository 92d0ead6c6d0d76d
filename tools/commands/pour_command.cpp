/// \file
/// `decant pour`: options, signals, and what is said in the end.
#include "reference/error.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/particles_option.hpp"
#include "tools/common/stop_signal.hpp"
#include "tools/pour/pour.hpp"
#include "tools/pour/pour_report.hpp"

#include <fmt/format.h>

#include <malloc.h>
#include <cstdio>
#include <cstdlib>
#include <limits>
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

constexpr const char* pour_footer =
    "Ctrl-C stops within a second, inside a frame too, and leaves a checkpoint; the same command with\n"
    "--resume goes on and ends in the same bits. A second Ctrl-C ends at once; the checkpoint before it\n"
    "still holds.\n"
    "A run that leaves what its time step and its speed of sound were chosen for says so, with the first\n"
    "frame and particle: limits_exceeded in --json.\n"
    "Exit status 1 where mass does not add up or a particle passed a wall, 130 after Ctrl-C.\n"
    "\n"
    "Example:\n"
    "  decant pour fixtures/scenes/pour-4k.json --out build/pour-4k --frames 100";

/// Every frame allocates and frees the same megabytes. Given back to the kernel each time, they would come anew by
/// thousands of page faults.
void keep_freed_memory() {
#ifdef __GLIBC__
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the largest that is taken
  ::mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
}

Scene scene_of(const PourArguments& arguments) {
  const auto at_least_one = [](const char* option, std::int64_t value, std::int64_t most) {
    if (value < 1 || value > most)
      throw InputError("command line", option, std::to_string(value), fmt::format("must be 1 … {}", most));
  };
  Scene scene = load_scene(arguments.scene);
  if (arguments.particles) scene = with_asked_particles(scene, *arguments.particles, arguments.scene);
  if (arguments.frames) {
    at_least_one("--frames", *arguments.frames, 1'000'000);
    scene = pour::with_frames(scene, static_cast<int>(*arguments.frames));
  }
  const auto warnings = check_scene(scene, arguments.scene);
  if (!arguments.quiet)
    for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  return scene;
}

int run(PourArguments& arguments) {
  keep_freed_memory();
  const Scene scene = scene_of(arguments);
  const auto backend = choose_backend(arguments.flags.applied_to(arguments.backend), arguments.executor);
  require_offers(*backend, arguments.backend, "pour");
  arguments.flags.require_used();
  const StopSignal signal;
  const BackendInfo info = backend->info();
  const auto tell_stopped = [&](const pour::Result& result) {
    if (arguments.json && result.frame >= 0) fmt::print("{}\n", pour::result_json(result, info, arguments.out));
    std::fflush(stdout);
    if (!arguments.quiet && result.frame < 0) fmt::print(stderr, "stopped before the first frame; nothing is kept\n");
    else if (!arguments.quiet)
      fmt::print(stderr, "stopped after frame {} of {}, at substep {}; the same command with --resume goes on\n",
                 result.frame, scene.schedule.frames, result.substep);
    return 128 + StopSignal::caught();
  };
  pour::Options options;
  options.out = arguments.out;
  options.csv = arguments.csv;
  options.perturbation = arguments.perturbation;
  options.resume = arguments.resume;
  options.quiet = arguments.quiet;
  options.stop = [] { return StopSignal::caught() != 0; };
  options.leave = [&](const pour::Result& result) { std::_Exit(tell_stopped(result)); };
  const pour::Result result = pour::run(scene, *backend, options);

  if (!result.finished) return tell_stopped(result);
  if (arguments.json) fmt::print("{}\n", pour::result_json(result, info, arguments.out));
  else if (!arguments.quiet) pour::print_result(result, info, scene);
  const bool conforms = result.summary.balanced() && !result.summary.penetrated();
  return conforms ? exit_pass : exit_does_not_conform;
}

}  // namespace

void add_pour_command(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand("pour", "run a scene; write frames, timeline, mass per region");
  auto a = std::make_shared<PourArguments>();
  command->add_option("SCENE", a->scene, "Scene file (JSON)")->required();
  command->add_option("--out", a->out, "Folder for frames.h5, *.xdmf, *.vtkhdf, timeline.h5, csv/")->required();
  command->add_option("--backend", a->backend, "reference, brute, …, plugin:PATH, python:FILE:CLASS")
      ->capture_default_str();
  command->add_option("--executor", a->executor, "auto, cuda or host")->capture_default_str();
  a->flags.add_to(*command);
  command->add_option("--particles", a->particles, "About this many; spacing and all that follows are derived anew");
  command->add_option("--frames", a->frames, "Frames over the same time; the substep stays within its limits");
  command->add_option("--perturb", a->perturbation,
                      "Seed of a random change of the start in its last bits, for ensembles");
  command->add_flag("--csv", a->csv, "Also write csv/fluid_000123.csv and boundaries");
  command->add_flag("--resume", a->resume, "Go on from the folder's last checkpoint");
  command->add_flag("--quiet", a->quiet, "Say nothing but errors");
  command->add_flag("--json", a->json, "Print the summary as JSON");
  command->footer(pour_footer);
  command->callback([a, &exit_status] { exit_status = run(*a); });
}

}  // namespace decant
