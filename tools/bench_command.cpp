/// \file
/// `decant bench`: what a substep costs each backend at recorded states. What does not conform is
/// not timed.
#include "oracle/conform.hpp"
#include "reference/error.hpp"
#include "tools/backend_choice.hpp"
#include "tools/commands.hpp"
#include "tools/fixture_folder.hpp"
#include "tools/output_place.hpp"
#include "version.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace decant {
namespace {

struct BenchArguments {
  std::vector<std::string> fixtures, backends;
  std::string executor = "auto", json;
  int substeps = 50, windows = 5;
};

constexpr const char* footer =
    "Each window starts from the recorded state again and advances it by --substeps; one more\n"
    "window before them warms up. The median window counts. Interactions are fluid and wall\n"
    "neighbors at the recorded state. A backend that fails a check on the recording is not timed.\n"
    "Exit status: 0 timed, 1 something does not conform, 2 bad input, 3 a backend failed,\n"
    "77 the device of --executor is absent.\n"
    "\n"
    "Examples:\n"
    "  decant bench --backend brute --executor cuda --json build/bench.json\n"
    "  decant bench fixtures/pour-4k-stream.h5 --backend reference,reference:all-pairs";

struct Window {
  double seconds = 0;
  StageTimes stages;
};

Window run_window(Backend& backend, const Fixture& fixture, const Walls& walls, int substeps) {
  backend.load(fixture.scene, walls, fixture.state);
  const auto start = std::chrono::steady_clock::now();
  const Status status = backend.advance(substeps);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  if (!status.ok()) throw BackendError(backend.info().name + ": " + describe(status));
  return {taken.count(), backend.stage_times()};
}

/// Why the backend must not be timed; empty where it conforms.
std::string objection(Backend& backend, const Fixture& fixture, const Judgement& oracle) {
  for (const CheckRow& row : judge(backend, fixture, oracle))
    if (judged_verdict(row) != Verdict::pass)
      return fmt::format("{} {} of {}: {}", row.check, row.field, fixture.name,
                         row.reason.empty() ? fmt::format("score {:.3g}", row.score) : row.reason);
  return {};
}

nlohmann::ordered_json time_backend(Backend& backend, const Fixture& fixture, const Walls& walls,
                                    const BenchArguments& arguments) {
  std::vector<Window> windows;
  for (int w = 0; w <= arguments.windows; ++w) {
    const Window window = run_window(backend, fixture, walls, arguments.substeps);
    if (w > 0) windows.push_back(window);
  }
  const auto middle = windows.begin() + static_cast<std::ptrdiff_t>(windows.size() / 2);
  std::nth_element(windows.begin(), middle, windows.end(),
                   [](const Window& a, const Window& b) { return a.seconds < b.seconds; });
  const auto microseconds = [&](double seconds) { return 1e6 * seconds / arguments.substeps; };
  const StageTimes& s = middle->stages;
  const double named = s.build.seconds + s.density.seconds + s.force.seconds + s.integrate.seconds;
  nlohmann::ordered_json stages = nullptr;  // of a backend that does not tell
  if (named > 0)
    stages = {{"build", microseconds(s.build.seconds)},
              {"density", microseconds(s.density.seconds)},
              {"force", microseconds(s.force.seconds)},
              {"integrate", microseconds(s.integrate.seconds)},
              {"other", std::max(0.0, microseconds(middle->seconds - named))}};

  backend.load(fixture.scene, walls, fixture.state);
  Fields fields = Fields::unwritten(fixture.state.size(), walls.size());
  if (const Status status = backend.evaluate(fields); !status.ok())
    throw BackendError(backend.info().name + ": " + describe(status));
  const double neighbors = fields.fluid_neighbor_count.cast<double>().mean() +
                           fields.wall_neighbor_count.cast<double>().mean();
  const BackendInfo info = backend.info();
  const double substep = microseconds(middle->seconds);
  return {
      {"backend", info.name},
      {"options", info.options},
      {"executor", info.executor},
      {"device", info.device},
      {"particles", fixture.state.size()},
      {"window", fixture.phase},
      {"substep_us", substep},
      {"stages_us", stages},
      {"neighbors_mean", neighbors},
      {"interactions_per_s", neighbors * static_cast<double>(fixture.state.size()) / substep * 1e6},
      {"conformant", true}};
}

void print(const nlohmann::ordered_json& row) {
  const auto text = [&](const char* key) { return row.at(key).get<std::string>(); };
  const std::string options = text("options").empty() ? "" : ":" + text("options");
  std::string stages;
  if (row.at("stages_us").is_object())
    for (const auto& [name, value] : row.at("stages_us").items())
      stages += fmt::format("  {} {:.1f}", name, value.get<double>());
  fmt::print("{:<22} {:<9} {:>9} {:<10} {:>12.1f}   {:.3g} interactions/s{}\n",
             text("backend") + options, text("executor"), row.at("particles").get<std::int64_t>(),
             text("window"), row.at("substep_us").get<double>(),
             row.at("interactions_per_s").get<double>(), stages);
  std::fflush(stdout);
}

void write_json(const std::string& file, const nlohmann::ordered_json& rows) {
  const nlohmann::ordered_json all = {{"decant_bench", 1},
                                      {"rows", rows},
                                      {"provenance",
                                       {{"version", version},
                                        {"git_revision", git_revision},
                                        {"compiler", compiler},
                                        {"flags", flags},
                                        {"build_type", build_type}}}};
  std::ofstream out(file);
  out << all.dump(2) << '\n';
  if (!out.flush()) throw InputError("command line", "--json", file, "a file that can be written");
}

int bench(const BenchArguments& arguments) {
  check_output_place("--json", arguments.json);
  std::vector<std::unique_ptr<Backend>> backends;
  auto names = arguments.backends;
  if (names.empty()) {
    names = backend_choices();
    if (arguments.executor == "cuda") std::erase(names, "reference");
  }
  for (const auto& name : names) backends.push_back(choose_backend(name, arguments.executor));
  std::vector<std::filesystem::path> files(arguments.fixtures.begin(), arguments.fixtures.end());
  if (files.empty()) files = fixtures_in(fixture_folder(), false);

  fmt::print("{:<22} {:<9} {:>9} {:<10} {:>12}\n", "backend", "executor", "particles", "window",
             "us/substep");
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  int status = exit_pass;
  for (const auto& file : files) {
    const Fixture fixture = read_fixture(file);
    const Judgement oracle = prepare(fixture);
    for (const auto& backend : backends) {
      if (const std::string why = objection(*backend, fixture, oracle); !why.empty()) {
        fmt::print("{:<22} does not conform, is not timed: {}\n", backend->info().name, why);
        status = exit_does_not_conform;
        continue;
      }
      rows.push_back(time_backend(*backend, fixture, oracle.walls, arguments));
      print(rows.back());
    }
  }
  if (!arguments.json.empty()) write_json(arguments.json, rows);
  return status;
}

}  // namespace

void add_bench_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<BenchArguments>();
  CLI::App* verb = app.add_subcommand("bench", "time a substep of backends that conform");
  verb->footer(footer);
  verb->add_option("FIXTURE", arguments->fixtures, "recordings (*.h5); default: the small ones");
  verb->add_option("--backend", arguments->backends,
                   "reference,reference:all-pairs,brute,…; default: all that the executor runs")
      ->delimiter(',')
      ->allow_extra_args(false);
  verb->add_option("--executor", arguments->executor, "auto, cuda or host")->capture_default_str();
  verb->add_option("--substeps", arguments->substeps, "substeps in a window")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  verb->add_option("--windows", arguments->windows, "windows to take the median of")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->add_option("--json", arguments->json, "write rows as JSON");
  verb->callback([arguments, &exit_status] { exit_status = bench(*arguments); });
}

}  // namespace decant
