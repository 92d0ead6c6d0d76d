/// \file
/// `decant record`: runs a scene to its phases and writes the oracle's answer at each.
#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/solution/digest.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_file.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/phases.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/recording.hpp"
#include "tools/pour/checkpoint.hpp"
#include "tools/pour/limits.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace decant {
namespace {

struct RecordArguments {
  std::string scene, out, from, backend = "reference", executor = "auto";
  std::vector<std::string> phases;
  // Long enough to show a viscosity wrong by 1 % in the energy of every phase, short enough for CI.
  std::int64_t ensemble_substeps = 32, ensemble_members = 24;
  bool sample = false, quiet = false;
};

constexpr const char* record_footer =
    "Phases: start, settled, tilt-onset, stream, splash, filling, rest, at times that follow from "
    "the\n"
    "scene's tilt, or NAME=TIME (s). Several phases, or none, with {phase} in --out: one file "
    "each.\n"
    "Positions and velocities are rounded to fp32; the fields are always the oracle's, whatever\n"
    "backend moved the fluid.\n"
    "\n"
    "Example:\n"
    "  decant record fixtures/scenes/pour-4k.json --out 'fixtures/pour-4k-{phase}.h5'";

/// Where the run starts.
struct Start {
  ParticleState state;
  std::string phase;                              // of a fixture, else empty
  std::string origin;                             // for the provenance
  std::map<std::string, std::string> provenance;  // of a fixture
};

/// The last frame of a finished pour at or before the first phase asked for.
ParticleState state_in_frames(const Hdf5Reader& frames, const Scene& scene, const std::vector<std::string>& phases) {
  const std::string file = frames.file().string();
  const std::string sha256 = sha256_of_text(scene_to_json(scene));
  if (frames.text_attribute("/", "scene_sha256") != sha256)
    throw InputError(file, "scene_sha256", frames.text_attribute("/", "scene_sha256"),
                     sha256 + ", that of the scene given (frames of the same number, too)");
  std::int64_t target = std::numeric_limits<std::int64_t>::max();
  for (const auto& text : phases) target = std::min(target, parse_phase(scene, text).substep);
  const std::int64_t per_frame = scene.schedule.substeps_per_frame;
  const std::int64_t last = frames.shape("/time").at(0) - 1;
  const std::int64_t frame = std::min(target / per_frame, last);
  ParticleState state;
  state.substep = frame * per_frame;
  state.position = frames.matrix3_at("/fluid/position", frame);
  state.velocity = frames.matrix3_at("/fluid/velocity", frame);
  if (!state.position.allFinite() || !state.velocity.allFinite())
    throw InputError(file, fmt::format("frame {}", frame), "not finite", "a frame that was written");
  return state;
}

/// Anybody's state: /position and /velocity, [N,3], at the root's attribute time (s), or 0.
ParticleState plain_state(const Hdf5Reader& reader, const Scene& scene) {
  ParticleState state;
  state.position = reader.matrix3("/position");
  state.velocity = reader.matrix3("/velocity", state.position.cols());
  if (reader.has_attribute("/", "time"))
    state.substep = parse_phase(scene, fmt::format("state={}", reader.real_attribute("/", "time"))).substep;
  if (!state.position.allFinite() || !state.velocity.allFinite())
    throw InputError(reader.file().string(), "/position and /velocity", "not finite", "finite numbers");
  return state;
}

Start start_of(const RecordArguments& arguments, const Scene& scene) {
  if (arguments.from.empty()) return {initial_state(scene), {}, "the scene's initial state", {}};
  const std::string& file = arguments.from;
  const Hdf5Reader reader(file);
  if (reader.has("/position"))
    return {plain_state(reader, scene),
            {},
            std::filesystem::path(file).filename().string() + " " + sha256_of_file(file),
            {}};
  if (reader.has("/fluid/position")) {
    const auto name = [&](const char* attribute) { return reader.text_attribute("/", attribute); };
    return {state_in_frames(reader, scene, arguments.phases),
            {},
            fmt::format("a frame of {} on {} ({}, {})", name("backend"), name("device"), name("executor"),
                        name("precision")),
            {}};
  }
  const auto take = [&](ParticleState state, const std::string& scene_json, std::string phase) {
    if (scene_json != scene_to_json(scene))
      throw InputError(file, "scene", "another scene", "the scene of " + arguments.scene);
    return Start{std::move(state),
                 std::move(phase),
                 std::filesystem::path(file).filename().string() + " " + sha256_of_file(file),
                 {}};
  };
  if (reader.has_attribute("/", "decant_fixture")) {
    Fixture fixture = read_fixture(file);
    Start taken = take(std::move(fixture.state), scene_to_json(fixture.scene), fixture.phase);
    taken.provenance = std::move(fixture.provenance);
    return taken;
  }
  pour::Checkpoint checkpoint = pour::read_checkpoint(file);
  return take(std::move(checkpoint.state), checkpoint.scene_json, {});
}

std::vector<Phase> phases_of(const RecordArguments& arguments, const Scene& scene, const Start& start) {
  const bool named_by_phase = arguments.out.find("{phase}") != std::string::npos;
  std::vector<Phase> phases;
  for (const auto& text : arguments.phases) phases.push_back(parse_phase(scene, text));
  if (phases.empty() && !arguments.from.empty())
    phases.push_back({start.phase.empty() ? "state" : start.phase, start.state.substep});
  if (phases.empty() && named_by_phase)
    for (const char* name : {"settled", "tilt-onset", "stream", "splash", "filling", "rest"})
      phases.push_back(parse_phase(scene, name));
  if (phases.empty()) phases.push_back(parse_phase(scene, "rest"));

  if (phases.size() > 1 && !named_by_phase)
    throw InputError("command line", "--out", arguments.out, "{phase} in it, for several phases");
  std::stable_sort(phases.begin(), phases.end(), [](const Phase& a, const Phase& b) { return a.substep < b.substep; });
  for (std::size_t k = 0; k < phases.size(); ++k) {
    if (phases[k].substep < start.state.substep)
      throw InputError("command line", "--phase", phases[k].name,
                       fmt::format("at or after {}, substep {}", start.origin, start.state.substep));
    for (std::size_t earlier = 0; earlier < k; ++earlier)
      if (phases[earlier].name == phases[k].name)
        throw InputError("command line", "--phase", phases[k].name, "each name once");
  }
  return phases;
}

/// Where a state is beyond what the scene's time step and speed of sound were chosen for.
/// \param density  N, kg/m³, the oracle's
std::vector<std::string> beyond_limits(const Scene& scene, const ParticleState& state, const Eigen::VectorXd& density) {
  if (state.size() == 0) return {};
  pour::TimelineRow row;
  Eigen::Index fastest = -1, densest = -1;
  row.frame = state.substep / scene.schedule.substeps_per_frame;
  row.max_speed = state.velocity.colwise().norm().maxCoeff(&fastest);
  row.max_density = density.maxCoeff(&densest);
  row.fastest_particle = fastest;
  row.densest_particle = densest;
  std::vector<std::string> all;
  for (const pour::LimitExceeded& e : pour::limits_exceeded({row}, limits_of(scene))) all.push_back(describe(e));
  return all;
}

void advance_to(std::int64_t target, std::int64_t& now, const Scene& scene, Backend& backend, Progress& progress,
                const std::string& phase) {
  const std::int64_t per_frame = scene.schedule.substeps_per_frame;
  while (now < target) {
    // As `pour` does, whole frames at a time: backends rebuild their neighbors at frame starts.
    const std::int64_t chunk = std::min(target - now, per_frame - now % per_frame);
    const Status status = backend.advance(static_cast<int>(chunk));
    if (!status.ok())
      throw BackendError(fmt::format("{} on the way to {}: {}", backend.info().name, phase, describe(status)));
    now += chunk;
    progress.update(now, phase);
  }
}

int record(const RecordArguments& arguments) {
  const Scene scene = load_scene(arguments.scene);
  const Start start = start_of(arguments, scene);
  const auto phases = phases_of(arguments, scene, start);
  check_output_place("--out", arguments.out);
  const auto backend = choose_backend(arguments.backend, arguments.executor);
  const BackendInfo info = backend->info();
  if (!arguments.quiet)
    fmt::print("{} ({}) on {}: {} particles\n", info.name, info.precision, info.device, start.state.size());
  std::fflush(stdout);

  if (!arguments.quiet && !arguments.from.empty()) {
    Fields fields;
    ConditionSums ignored;
    (void)evaluate_oracle(scene, start.state, fields, ignored);
    for (const std::string& beyond : beyond_limits(scene, start.state, fields.density))
      fmt::print(stderr, "warning: {}: {}\n", arguments.from, beyond);
  }
  if (const std::string revision = build_provenance().at("git_revision");
      revision.ends_with("-dirty") && !arguments.quiet)
    fmt::print(stderr,
               "warning: this program is of revision {}, which nobody can get again; a fixture that is to "
               "be kept wants a program built from what is committed\n",
               revision);
  backend->load(scene, sample_walls(scene), start.state);
  std::int64_t now = start.state.substep;
  Progress progress("substep", phases.back().substep, now, arguments.quiet);
  for (const Phase& phase : phases) {
    advance_to(phase.substep, now, scene, *backend, progress, phase.name);
    Fixture fixture;
    fixture.phase = phase.name;
    fixture.scene = scene;
    backend->read(fixture.state);
    fixture.state.substep = now;
    const std::string ill_posed_reason =
        record_answer(fixture, arguments.ensemble_substeps, arguments.ensemble_members);
    const auto beyond = beyond_limits(scene, fixture.state, fixture.fields->density);
    if (arguments.sample) reduce_to_sample(fixture);
    fixture.provenance = recording_provenance(info, start.origin);
    fixture.provenance["scene_file"] = std::filesystem::path(arguments.scene).filename().string();
    if (!beyond.empty()) fixture.provenance["limits_exceeded"] = fmt::format("{}", fmt::join(beyond, "; "));
    // Recorded anew from a fixture as it is: what brought the fluid there stays true.
    if (phase.substep == start.state.substep)
      for (const auto& [key, value] : start.provenance)
        if (key.starts_with("advanced_") || key == "started_from") fixture.provenance[key] = value;
    const std::string file = phase_file(arguments.out, phase.name);
    write_fixture(file, fixture);
    progress.pause();
    if (!arguments.quiet)
      fmt::print("{}: {} at {:.6g} s, substep {}, {} bytes\n", file, phase.name, scene.time_at(now), now,
                 std::filesystem::file_size(file));
    if (!arguments.quiet)
      for (const std::string& one : beyond) fmt::print(stderr, "warning: {}: {}\n", file, one);
    if (!ill_posed_reason.empty()) fmt::print(stderr, "warning: {}: {}\n", file, ill_posed_reason);
    std::fflush(stdout);
  }
  return exit_pass;
}

}  // namespace

void add_record_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<RecordArguments>();
  CLI::App* verb = app.add_subcommand("record", "run a scene and write fixtures");
  verb->footer(record_footer);
  verb->add_option("SCENE", arguments->scene, "scene file (*.json)")->required();
  verb->add_option("--out", arguments->out, "file to write; {phase} in it becomes the phase's name")->required();
  verb->add_option("--phase", arguments->phases, "NAME or NAME=TIME (s); may be repeated")->allow_extra_args(false);
  verb->add_option("--from", arguments->from,
                   "start from a frames.h5, a checkpoint.h5, a fixture, or any HDF5 file with\n"
                   "/position and /velocity, [N,3], and an attribute time");
  verb->add_option("--backend", arguments->backend, "what moves the fluid: reference, brute, …")->capture_default_str();
  verb->add_option("--executor", arguments->executor, "auto, cuda or host")->capture_default_str();
  verb->add_flag("--sample", arguments->sample, "study scale: a digest and a sample of the fields");
  verb->add_option("--ensemble-substeps", arguments->ensemble_substeps,
                   "how long the perturbed runs of the trajectory check are")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  verb->add_option("--ensemble-members", arguments->ensemble_members, "how many they are")
      ->check(CLI::Range(2, 10'000))
      ->capture_default_str();
  verb->add_flag("--quiet", arguments->quiet, "no output");
  verb->callback([arguments, &exit_status] { exit_status = record(*arguments); });
}

}  // namespace decant
