/// \file
/// `decant drift`: how stale a neighbor list may be.
#include "oracle/files/fixture_file.hpp"
#include "oracle/solution/fixture.hpp"
#include "reference/error.hpp"
#include "reference/scene_file.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/fixture_folder.hpp"
#include "tools/commands/interruptible.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/common/phases.hpp"
#include "tools/common/progress.hpp"
#include "tools/drift/drift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace decant {
namespace {

struct DriftArguments {
  std::vector<std::string> inputs;
  std::vector<int> intervals = {1, 2, 5, 10, 20, 50};
  std::vector<double> skins = {0, 0.05, 0.1, 0.2};
  int window = 50, samples = 64;
  std::string backend = "list", executor = "auto", report, series;
  bool recommend = false, untimed = false, whole = false, quiet = false;
  double tolerance = 1e-3;
};

constexpr int perturbed_pours = 4;

constexpr const char* drift_footer =
    "From each state a window of substeps is run with lists that miss nothing. Along it, lists rebuilt\n"
    "every N substeps with a skin (a share of H) are compared pair by pair with all pairs, and what\n"
    "they miss is put into a double evaluation, so that errors below fp32's noise show. A recording\n"
    "gives one state; a scene is run, gives one at each phase, and is looked at all along.\n"
    "  missed, worst   share of the pairs within H that the list lacks: mean, largest over the window\n"
    "  own             the same of the backend's own list, counted by itself (list:check_completeness=on)\n"
    "  expected        by theory, from the first state alone, just before a rebuild\n"
    "  first, proved   substeps after a rebuild until a pair is missed, and for which displacements\n"
    "                  prove that none is (two largest of the fluid, or of fluid and wall <= skin)\n"
    "  density, accel.  RMS error over RMS field, the largest; wall's: the wall's terms alone\n"
    "  deviation       of positions after the fixture's ensemble length, over the ensemble's own\n"
    "  us              per substep by the backend, rebuilds included\n"
    "`auto` rebuilds before a pair can be missed: the point to beat. Safe intervals: measured, proved by\n"
    "the displacements seen, expected from the first state's speeds, and from how fast pairs near H\n"
    "approach. Powers: of the relative motion, ± 95 %, (what the kernel's edge gives).\n"
    "--recommend also tries, for each interval, the skin that theory asks for (*), and keeps half the\n"
    "tolerance for states that were not measured.\n"
    "A plug-in that offers to choose lists (options rebuild, skin) is swept as `list` is. Others get a row\n"
    "`own`: what the lists that they give lack, or else how far their fields are from the oracle's at the\n"
    "same states; deviation is then from the oracle's run.\n"
    "Exit status: 0 measured, 1 --recommend finds nothing within the tolerance, 2 bad input, 3 a\n"
    "backend failed, 77 the device of --executor is absent, 130 after Ctrl-C (143: SIGTERM): what was\n"
    "measured by then is in table and report.\n"
    "\n"
    "Examples:\n"
    "  decant drift --report build/drift.h5\n"
    "  decant drift fixtures/pour-4k-splash.h5 --intervals 1,10 --skins 0\n"
    "  decant drift fixtures/scenes/pour-4k.json --full-run --report build/pour.h5\n"
    "  decant drift --recommend --tolerance 1e-4\n"
    "  decant drift fixtures/pour-4k-splash.h5 --series lists-of-mine.h5";

std::vector<std::string> default_fixtures() {
  std::vector<std::string> pours;
  for (const auto& file : fixtures_in(fixture_folder(), false))
    if (file.filename().string().starts_with("pour-")) pours.push_back(file.string());
  return pours;
}

void check(DriftArguments& arguments) {
  const auto refuse = [](const char* option, const std::string& value, const char* bound) {
    throw InputError("command line", option, value, bound);
  };
  for (const int n : arguments.intervals)
    if (n < 1 || n > 1000) refuse("--intervals", std::to_string(n), "1 to 1000 substeps");
  for (const double s : arguments.skins)
    if (!(s >= 0 && s <= 1)) refuse("--skins", fmt::format("{}", s), "0 to 1, shares of H");
  if (arguments.window < 2 || arguments.window > 1000)
    refuse("--window", std::to_string(arguments.window), "2 to 1000 substeps");
  if (arguments.samples < 1 || arguments.samples > 100'000)
    refuse("--samples", std::to_string(arguments.samples), "1 to 100000");
  if (!(arguments.tolerance > 0)) refuse("--tolerance", fmt::format("{}", arguments.tolerance), "> 0");
  if (arguments.recommend && arguments.untimed) refuse("--recommend", "given", "without --untimed: it compares times");
  if (arguments.backend != "list" && !is_plugin(arguments.backend))
    refuse("--backend", arguments.backend, "list, which alone keeps lists, or a plug-in");
  if (!arguments.series.empty() && arguments.inputs.size() != 1)
    refuse("--series", arguments.series, "one FIXTURE, whose scene it is of");
  if (!arguments.series.empty() && (arguments.recommend || arguments.whole))
    refuse("--series", arguments.series, "without --recommend and --full-run: it is only looked at");
  check_output_place("--report", arguments.report);
}

/// Throws InputError where a plug-in cannot be asked for this.
void check_offers(const DriftArguments& arguments, const Backend& plugin) {
  const auto refuse = [&](const char* option, const char* bound) {
    throw InputError("command line", option, arguments.backend, bound);
  };
  constexpr std::uint32_t needed = Offer::density | Offer::acceleration;
  if (!(plugin.offers() & Offer::step)) refuse("--backend", "a plug-in that offers to advance");
  if (!(plugin.offers() & Offer::lists) && (plugin.offers() & needed) != needed)
    refuse("--backend", "a plug-in that offers its lists, or density and acceleration");
  if (plugin.offers() & Offer::rebuild) return;
  if (arguments.recommend) refuse("--recommend", "only for a plug-in that offers to choose lists (rebuild, skin)");
  if (arguments.whole) refuse("--full-run", "only for a plug-in that offers to choose lists (rebuild, skin)");
}

/// States of a scene to begin windows from: the phases of a pour, or eighths of the time.
std::vector<Fixture> phases_of(const Scene& scene) {
  const bool tilts = std::any_of(scene.containers.begin(), scene.containers.end(),
                                 [](const Container& c) { return c.tilt && c.tilt->keys.size() > 1; });
  std::vector<Phase> phases;
  if (tilts)
    for (const char* name : {"settled", "tilt-onset", "stream", "splash", "filling", "rest"})
      phases.push_back(parse_phase(scene, name));
  else
    for (const int part : {1, 3, 5, 7})
      phases.push_back(parse_phase(scene, fmt::format("{}-8ths={}", part, part / 8.0 * scene.schedule.end)));
  std::vector<Fixture> states;
  for (const Phase& phase : phases) {
    Fixture state;
    state.name = scene.name + "@" + phase.name;
    state.phase = phase.name;
    state.scene = scene;
    state.state.substep = phase.substep;
    states.push_back(std::move(state));
  }
  return states;
}

void print(const drift::Recommendation* best, const std::string& backend, double tolerance, std::size_t windows) {
  if (!best) {
    fmt::print("\nno list measured stays within {:g}, not even the adaptive one\n", tolerance);
    return;
  }
  const bool adaptive = best->list.interval == 0;
  fmt::print(
      "\nrecommended, for acceleration within {:g} (relative RMS) in each of {} windows: --backend {}{}{}\n"
      "  error {:.1e} at the worst substep, {}; {:.1f} us per substep, the adaptive list {:.1f} us\n",
      tolerance, windows, backend, adaptive ? "" : ":", best->list.options(), best->worst_error,
      adaptive ? "by proof" : fmt::format("theory expected {:.1e}", best->expected_error), best->substep_us,
      best->adaptive_us);
  if (adaptive)
    fmt::print(
        "  why: no fixed interval within the tolerance is faster than rebuilding when "
        "displacements ask for it\n");
  else
    fmt::print("  why: the fastest list that stays within it in every window{}{}\n",
               best->list.derived ? "; its skin is the one that theory asks for" : "",
               best->substep_us > best->adaptive_us ? "; the adaptive list was not timed faster" : "");
  if (best->next_us < best->substep_us)
    fmt::print("  what is faster errs more: {:.1f} us, {:.1e}\n", best->next_us, best->next_error);
}

void run(DriftArguments& arguments, int& exit_status) {
  check(arguments);
  if (!arguments.series.empty()) {
    const drift::Result result =
        drift::measure_series(read_fixture(recording_called(arguments.inputs.front())), arguments.series);
    fmt::print("{}", drift::table({result}));
    if (!arguments.report.empty())
      drift::write(arguments.report, {result}, {}, {"series", "", "given", "unknown", "unknown"});
    exit_status = exit_pass;
    return;
  }
  const bool plugin = is_plugin(arguments.backend);
  const drift::ListMaker make_list = [&](const drift::ListChoice& list, bool counting) {
    const std::string options = list.options();
    // A plug-in's misses are counted from the lists that it gives.
    return choose_backend(arguments.backend + (options.empty() ? "" : ":" + options) +
                              (counting && !plugin ? ":check_completeness=on" : ""),
                          arguments.executor);
  };
  const auto asked = make_list(drift::own_list, false);
  const BackendInfo info = asked->info();
  if (plugin) check_offers(arguments, *asked);
  if (arguments.inputs.empty()) arguments.inputs = default_fixtures();
  drift::Plan plan{drift::all_lists(arguments.intervals, arguments.skins),
                   !plugin || (asked->offers() & Offer::rebuild), arguments.window, !arguments.untimed};
  std::vector<Fixture> states;
  std::vector<Scene> scenes;
  for (const auto& file : arguments.inputs) {
    if (std::filesystem::path(file).extension() == ".json") {
      scenes.push_back(load_scene(file));
      continue;
    }
    states.push_back(read_fixture(recording_called(file)));
    if (states.back().state.size() == 0)
      throw InputError(file, "/state/position", "no particles", "a state with fluid");
  }
  if (arguments.whole && scenes.empty())
    throw InputError("command line", "--full-run", "given", "with a scene (*.json)");
  std::vector<drift::PourResult> pours;
  std::vector<drift::Result> results;
  Interruptible work([&] {
    if (!arguments.quiet) fmt::print(stderr, "\n");
    const std::string line = interrupted_line(static_cast<std::int64_t>(results.size()),
                                              static_cast<std::int64_t>(states.size()), "windows measured");
    fmt::print("{}{}{}\n", drift::table(results), drift::pour_table(pours), line);
    std::fflush(stdout);
    if (!arguments.report.empty()) drift::write(arguments.report, results, pours, info, line);
  });
  for (const Scene& scene : scenes) {
    Progress progress("pour", 1, 0, arguments.quiet);
    progress.update(0, scene.name);
    std::vector<Fixture> phases = phases_of(scene);
    drift::PourResult pour;
    work.part([&] { pour = drift::along_pour(scene, plan, arguments.samples, make_list, phases); });
    pours.push_back(std::move(pour));
    for (Fixture& phase : phases) states.push_back(std::move(phase));
    if (arguments.whole)
      drift::whole_pours(
          scene, plan, perturbed_pours, make_list, [&](const auto& part) { work.part(part); }, pours.back().whole);
    progress.update(1, scene.name);
  }
  if (arguments.recommend)
    for (const drift::ListChoice& list : drift::derived_lists(states, arguments.intervals, 0.5 * arguments.tolerance))
      if (std::none_of(plan.lists.begin(), plan.lists.end(), [&](const drift::ListChoice& other) {
            return other.interval == list.interval && other.skin == list.skin;
          }))
        plan.lists.push_back(list);
  {
    Progress progress("window", static_cast<std::int64_t>(states.size()), 0, arguments.quiet);
    for (const Fixture& state : states) {
      progress.update(static_cast<std::int64_t>(results.size()), state.name);
      drift::Result result;
      work.part([&] {
        result = drift::measure(state, plan, make_list, [&](double part) {
          progress.update(static_cast<std::int64_t>(results.size()), state.name, part);
        });
      });
      results.push_back(std::move(result));
    }
    progress.update(static_cast<std::int64_t>(results.size()));
  }
  fmt::print("{}{}", drift::table(results), drift::pour_table(pours));
  if (!arguments.report.empty()) drift::write(arguments.report, results, pours, info);
  exit_status = exit_pass;
  if (!arguments.recommend) return;
  const auto best = drift::recommend(results, arguments.tolerance);
  print(best.get(), arguments.backend, arguments.tolerance, results.size());
  if (!best) exit_status = exit_does_not_conform;
}

}  // namespace

void add_drift_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<DriftArguments>();
  CLI::App& verb = *app.add_subcommand("drift", "measures what neighbor lists miss that are rebuilt every N substeps");
  verb.add_option("INPUT", arguments->inputs,
                  "recordings and scenes (*.json); the small recorded pours where none is named");
  verb.add_option("--intervals", arguments->intervals, "substeps between rebuilds")
      ->delimiter(',')
      ->capture_default_str();
  verb.add_option("--skins", arguments->skins, "shares of H")->delimiter(',')->capture_default_str();
  verb.add_option("--window", arguments->window, "substeps that are run from each state")->capture_default_str();
  verb.add_option("--backend", arguments->backend, "list, plugin:PATH or python:FILE:CLASS: what is timed and followed")
      ->capture_default_str();
  verb.add_option("--executor", arguments->executor, "cuda, host, or auto: the GPU where there is one")
      ->capture_default_str();
  verb.add_option("--report", arguments->report, "HDF5 file for rows and samples");
  verb.add_flag("--recommend", arguments->recommend, "names an interval and a skin");
  verb.add_option("--tolerance", arguments->tolerance, "of the acceleration, relative RMS, for --recommend")
      ->capture_default_str();
  verb.add_option("--samples", arguments->samples, "moments of a scene at which lists are compared")
      ->capture_default_str();
  verb.add_option("--looks", arguments->samples)->group("");
  verb.add_option("--series", arguments->series,
                  "HDF5 with another program's states and lists (oracle/formats/list-series.md)");
  verb.add_flag("--full-run", arguments->whole, "of a scene: pours it from end to end with every list");
  verb.add_flag("--whole", arguments->whole)->group("");
  verb.add_flag("--untimed", arguments->untimed, "lists are compared, not run");
  verb.add_flag("--quiet", arguments->quiet, "no progress on standard error");
  verb.footer(drift_footer);
  verb.callback([arguments, &exit_status] { run(*arguments, exit_status); });
}

}  // namespace decant
