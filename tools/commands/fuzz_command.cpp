/// \file
/// `decant fuzz`: property-based tests on random scenes.
#include "reference/error.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/stop_signal.hpp"
#include "tools/fuzz/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

namespace decant {
namespace {

struct FuzzArguments {
  std::vector<std::string> backends = {"brute", "hash", "list"}, properties;
  std::string executor = "auto", report, failures = "build/fuzz";
  std::uint64_t seed = 1;
  std::int64_t cases = -1;
  double seconds = 0;
  int threads = 0, most_counterexamples = 16;
  bool no_minimising = false, quiet = false, write = false;
};

std::string footer() {
  std::string text =
      "Each seed gives a small scene and a hostile or harmless state in it. A campaign takes consecutive\n"
      "seeds; campaigns of disjoint seeds may run side by side: `decant campaign fuzz` of the Python package\n"
      "shares seeds out to the workers of a cluster, and tools/python/merge_fuzz.py joins any campaigns'\n"
      "reports. What fails is minimised and written as a fixture, which `decant conform` shows again, with\n"
      "its scene beside it. Ctrl-C ends a campaign and keeps what it found: exit status 130.\n"
      "\n"
      "Properties; where none is named, the expensive ones are asked of every 2nd, 4th or 8th case:\n";
  for (const fuzz::Property& p : fuzz::properties()) text += fmt::format("  {:<13} {}\n", p.name, p.sentence);
  return text +
         "Exit status: 0 all hold, 1 a property does not hold, 2 bad input, 77 the device of\n"
         "--executor is absent.\n"
         "\n"
         "Examples:\n"
         "  decant fuzz --cases 1000\n"
         "  decant fuzz --backend hash --seconds 600 --seed 100001 --report build/fuzz.h5\n"
         "  decant fuzz --backend list:criterion=relative --property lists --cases 10000\n"
         "  decant fuzz --seed 1067584 --write";
}

std::set<std::string> chosen(const std::vector<std::string>& given) {
  std::set<std::string> known, names(given.begin(), given.end());
  std::string all;
  for (const fuzz::Property& p : fuzz::properties()) {
    known.insert(p.name);
    all += (all.empty() ? "" : ", ") + std::string(p.name);
  }
  if (names.empty()) return known;
  for (const auto& name : names)
    if (!known.contains(name)) throw InputError("command line", "--property", name, "of " + all);
  return names;
}

void run(FuzzArguments& arguments, int& exit_status) {
  if (arguments.write) {
    const std::string seed = fmt::format("{}", arguments.seed);
    fmt::print("decant conform {}\n", fuzz::write_case(arguments.failures, fuzz::random_case(arguments.seed),
                                                       "fuzz-" + seed, {{"fuzz_seed", seed}}));
    return;
  }
  if (arguments.cases < 0 && arguments.seconds <= 0) arguments.cases = 1000;
  if (arguments.seconds < 0) throw InputError("command line", "--seconds", fmt::format("{}", arguments.seconds), "> 0");
  check_output_place("--report", arguments.report);
  const auto make = [&](const std::string& choice) { return choose_backend(choice, arguments.executor); };
  BackendInfo info;
  for (const auto& name : arguments.backends) {
    const auto backend = make(name);
    require_offers(*backend, name, "fuzz");
    info = backend->info();
  }

  fuzz::Settings settings;
  settings.backends = arguments.backends;
  settings.properties = chosen(arguments.properties);
  settings.every_case = !arguments.properties.empty();
  settings.first_seed = arguments.seed;
  settings.cases = arguments.cases;
  settings.seconds = arguments.seconds;
  settings.threads =
      arguments.threads > 0 ? arguments.threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  settings.most_counterexamples = arguments.most_counterexamples;
  settings.minimise_tries = arguments.no_minimising ? 0 : 2000;
  settings.failures = arguments.failures;
  const StopSignal signal;
  settings.stop = [] { return StopSignal::caught() != 0; };
  fuzz::Campaign result;
  {
    Progress progress("case", std::max<std::int64_t>(arguments.cases, 1), 0, arguments.quiet || arguments.cases < 0);
    settings.progress = [&](const fuzz::Campaign& now) {
      double worst = 0;
      std::int64_t failed = 0;
      for (const auto& counted : now.statistics) {
        worst = std::max(worst, counted.worst);
        failed += counted.failed;
      }
      const std::string note = fmt::format("{:.0f} per second, worst score {:.3f}, {} failures",
                                           static_cast<double>(now.cases) / now.seconds, worst, failed);
      if (arguments.cases >= 0) progress.update(now.cases, note);
      else if (!arguments.quiet) fmt::print(stderr, "\r{:.0f} s, {} cases, {}  ", now.seconds, now.cases, note);
    };
    result = fuzz::run_campaign(settings, make);
    if (arguments.cases < 0 && !arguments.quiet) fmt::print(stderr, "\n");
  }
  fmt::print("{}", fuzz::campaign_table(result));
  if (!arguments.report.empty()) fuzz::write_campaign(arguments.report, result, info);
  const bool holds = std::all_of(result.statistics.begin(), result.statistics.end(),
                                 [](const fuzz::PropertyStatistics& t) { return t.failed == 0; });
  exit_status = holds ? exit_pass : exit_does_not_conform;
  if (StopSignal::caught() == 0) return;
  fmt::print("interrupted: {} cases asked\n", result.cases);
  exit_status = 128 + StopSignal::caught();
}

}  // namespace

void add_fuzz_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<FuzzArguments>();
  CLI::App& verb = *app.add_subcommand("fuzz", "property-based tests on random scenes; counterexamples are minimised");
  verb.add_option("--backend", arguments->backends,
                  "NAME, NAME:OPTIONS, plugin:PATH or python:FILE:CLASS, several by commas")
      ->delimiter(',')
      ->capture_default_str();
  verb.add_option("--executor", arguments->executor, "cuda, host, or auto: the GPU where there is one")
      ->capture_default_str();
  verb.add_option("--property", arguments->properties, "by name, each asked of every case; all where none is given")
      ->delimiter(',');
  verb.add_option("--cases", arguments->cases, "how many; 1000 where neither this nor --seconds is given")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 40));
  verb.add_option("--seconds", arguments->seconds, "time after which no case is begun");
  verb.add_option("--seed", arguments->seed, "of the first case")->capture_default_str();
  verb.add_option("--threads", arguments->threads, "cases at a time; 0: as many as there are cores")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  verb.add_option("--report", arguments->report, "HDF5 file (oracle/formats/fuzz.md)");
  verb.add_option("--failures", arguments->failures, "folder for what fails")->capture_default_str();
  verb.add_option("--most-findings", arguments->most_counterexamples)->check(CLI::Range(1, 10000))->group("");
  verb.add_flag("--no-shrink", arguments->no_minimising)->group("");
  verb.add_option("--most-counterexamples", arguments->most_counterexamples, "counterexamples after which to stop")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  verb.add_flag("--no-minimise", arguments->no_minimising, "save failures as they are found");
  verb.add_flag("--write", arguments->write,
                "only write the case of --seed into --failures, to look at what a report calls worst");
  verb.add_flag("--quiet", arguments->quiet, "no progress on standard error");
  verb.footer(footer());
  verb.callback([arguments, &exit_status] { run(*arguments, exit_status); });
}

}  // namespace decant
