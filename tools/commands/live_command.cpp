/// \file
/// `decant live`: options, where the page is, and until when.
#include "oracle/files/fixture_file.hpp"
#include "reference/error.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/common/stop_signal.hpp"
#include "tools/live/run.hpp"
#include "tools/live/server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

namespace decant {
namespace {

struct LiveArguments {
  BackendFlags flags;
  std::string scene, backend = "list", executor = "auto", keep = ".";
  std::optional<std::int64_t> particles;
  std::uint16_t port = 0;
  double pictures = 30;
  bool paused = false, quiet = false;
};

constexpr const char* live_footer =
    "Prints the page's address and serves it on the loopback address until Ctrl-C. From another machine,\n"
    "ssh -N -L PORT:127.0.0.1:PORT HOST, then the same address there.\n"
    "\n"
    "The page tilts cups, changes gravity, viscosity, spacing, fill, backend and its options, looks back,\n"
    "and draws scores against the oracle. \"keep this\" saves the instant as a recording into --keep;\n"
    "\"judge this\" runs conform on it.\n"
    "\n"
    "Example:\n"
    "  decant live fixtures/scenes/pour-4k.json --backend hash\n"
    "  decant live fixtures/pour-56k-stream.h5";

/// Where a run starts.
struct Start {
  live::LiveScene scene;
  std::optional<ParticleState> state;  // none: the scene's initial state
};

Start start_of(const std::string& file) {
  if (file.ends_with(".h5")) {
    Fixture fixture = read_fixture(file);
    const int substeps = fixture.scene.schedule.substeps_per_frame;
    // Where the rules of this build give another substep, the recording's number would mean another time.
    if (fixture.scene.schedule.substeps_derived && substeps_for(fixture.scene) != substeps)
      fixture.scene.schedule.substeps_derived = false;
    return {live::LiveScene(scene_to_json(fixture.scene), file, Distances::known), std::move(fixture.state)};
  }
  return {live::LiveScene(read_scene_text(file), file), std::nullopt};
}

/// Ends the server before the run that its pages ask.
struct Serving {
  live::Server& server;
  ~Serving() { server.stop(); }
};

/// Ends the process a second after a signal: a scene that is made, or a long call of a backend, has no end to wait for.
void leave_late(const std::stop_token& done) {
  int waited = 0;
  while (!done.stop_requested() && waited < 20) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    if (StopSignal::caught() != 0) ++waited;
  }
  if (!done.stop_requested()) std::_Exit(128 + StopSignal::caught());
}

std::string host_name() {
  char name[HOST_NAME_MAX + 1] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "HOST";
}

int run(LiveArguments& arguments) {
  if (!(arguments.pictures > 0 && arguments.pictures <= 1000))
    throw InputError("command line", "--pictures", fmt::format("{}", arguments.pictures),
                     "must be in 0 … 1000 per second");
  check_output_folder("--keep", arguments.keep);
  const std::filesystem::path keep(arguments.keep);
  if (const auto holds = is_directory(keep) ? keep : std::filesystem::absolute(keep / "").parent_path().parent_path();
      ::access(holds.c_str(), W_OK) != 0)
    throw InputError("command line", "--keep", arguments.keep, "a folder that can be written to");
  auto [scene, state] = start_of(arguments.scene);
  if (arguments.particles && state)
    throw InputError("command line", "--particles", std::to_string(*arguments.particles), "a scene, not a recording");
  if (arguments.particles) scene.set_particles(*arguments.particles);
  live::Options options;
  options.start = std::move(state);
  options.backend = arguments.flags.applied_to(arguments.backend);
  arguments.flags.require_used();
  options.backends = backend_choices();
  options.make_backend = [executor = arguments.executor](const std::string& choice) {
    auto backend = choose_backend(choice, is_plugin(choice) || choice.starts_with("reference") ? "auto" : executor);
    require_offers(*backend, choice, "live");
    return backend;
  };
  options.keep = arguments.keep;
  options.pictures_per_second = arguments.pictures;
  options.paused = arguments.paused;
  options.executor = arguments.executor;

  const StopSignal signal;
  const std::jthread impatience(leave_late);
  live::Server server(arguments.port);
  live::Run pour(std::move(scene), std::move(options), server);
  pour.start();
  server.serve([&](std::string ask) { pour.ask(std::move(ask)); });
  const Serving serving{server};
  fmt::print("{}\n", server.address());
  if (!arguments.quiet)
    fmt::print("Ctrl-C ends it. From another machine: ssh -N -L {0}:127.0.0.1:{0} {1}, then the same address there.\n",
               server.port(), host_name());
  std::fflush(stdout);
  pour.go([] { return StopSignal::caught() != 0; });
  const int status = 128 + StopSignal::caught();
  // A recording under way is given up: what is not whole leaves no file.
  if (pour.busy()) std::_Exit(status);
  return status;
}

}  // namespace

void add_live_command(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand("live", "run a scene, shown and changed in a browser");
  auto a = std::make_shared<LiveArguments>();
  command->add_option("SCENE", a->scene, "Scene file (JSON), or a recording (*.h5) to start from")->required();
  command->add_option("--backend", a->backend, "reference, brute, …, plugin:PATH, python:FILE:CLASS")
      ->capture_default_str();
  command->add_option("--executor", a->executor, "auto, cuda or host")->capture_default_str();
  a->flags.add_to(*command);
  command->add_option("--particles", a->particles, "About this many; spacing and all that follows are derived anew");
  command->add_option("--port", a->port, "Port on the loopback address; 0: one that is free")->capture_default_str();
  command->add_option("--keep", a->keep, "Folder of what is kept")->capture_default_str();
  command->add_option("--pictures", a->pictures, "Pictures per second at most")->capture_default_str();
  command->add_flag("--paused", a->paused, "Wait for \"go on\"");
  command->add_flag("--quiet", a->quiet, "Print the address alone");
  command->footer(live_footer);
  command->callback([a, &exit_status] { exit_status = run(*a); });
}

}  // namespace decant
