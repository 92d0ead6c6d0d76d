/// \file
/// `decant validate`: how right the solver is, by cases whose answer is known.
#include "reference/error.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/fixture_folder.hpp"
#include "tools/commands/interruptible.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/common/progress.hpp"
#include "tools/validation/validation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace decant {
namespace {

struct ValidateArguments {
  BackendFlags flags;
  std::vector<std::string> cases;
  std::string backend = "reference", executor = "auto", report;
  std::vector<int> resolutions;
  bool list = false, quick = false, quiet = false;
};

constexpr const char* validate_footer =
    "Without arguments every case runs at the resolutions that its executor affords: all of them on a\n"
    "GPU, the coarser ones on the host. --quick is the part that takes minutes on two cores. A gate that\n"
    "is not met stays in the table with its figure; nothing is loosened. Any backend can be validated,\n"
    "but a port is judged by `decant conform`: passing here says that the physics is right, not that\n"
    "two solvers agree.\n"
    "Exit status: 0 every gate met, 1 some gate not met, 2 bad input, 3 a backend failed,\n"
    "77 the device of --executor is absent, 130 after Ctrl-C (143: SIGTERM): what was judged by then is in\n"
    "table and report.\n"
    "\n"
    "Examples:\n"
    "  decant validate --list\n"
    "  decant validate --quick --backend hash --executor host\n"
    "  decant validate dam-front --backend list --report build/validation.h5\n"
    "  build/venv/bin/python tools/python/validation_page.py build/validation.h5 \\\n"
    "    --out build/validation";

std::vector<const validate::Case*> chosen_cases(const std::vector<std::string>& names) {
  std::vector<const validate::Case*> chosen;
  std::string known;
  for (const auto& which : validate::cases()) {
    known += (known.empty() ? "" : ", ") + which.name;
    if (names.empty() || std::find(names.begin(), names.end(), which.name) != names.end()) chosen.push_back(&which);
  }
  for (const auto& name : names)
    if (std::none_of(chosen.begin(), chosen.end(), [&](const auto* c) { return c->name == name; }))
      throw InputError("command line", "CASE", name, "one of " + known);
  return chosen;
}

std::vector<int> resolutions_of(const validate::Case& which, const ValidateArguments& arguments,
                                const std::string& executor) {
  if (!arguments.resolutions.empty()) return arguments.resolutions;
  if (arguments.quick) return which.quick > 0 ? std::vector<int>{which.quick} : std::vector<int>{};
  std::vector<int> affordable = which.resolutions;
  if (executor != "cuda") std::erase_if(affordable, [&](int n) { return n > which.affordable; });
  return affordable;
}

void print_list() {
  for (const auto& which : validate::cases()) {
    std::string resolutions;
    for (const int n : which.resolutions) resolutions += (resolutions.empty() ? "" : ", ") + std::to_string(n);
    fmt::print("{:<13} {}\n{:<13} {}; {} particles along {:g} m{}\n", which.name, which.title, "", which.source,
               resolutions, which.length, which.quick ? fmt::format("; {} with --quick", which.quick) : "");
  }
}

void run(ValidateArguments& arguments, int& exit_status) {
  if (arguments.list) return print_list();
  if (arguments.quick && !arguments.resolutions.empty())
    throw InputError("command line", "--quick", "given", "without --resolution");
  for (const int n : arguments.resolutions)
    if (n < 4 || n > 1000) throw InputError("command line", "--resolution", std::to_string(n), "4 to 1000");
  check_output_place("--report", arguments.report);
  const auto chosen = chosen_cases(arguments.cases);
  const auto fixtures = fixture_folder();
  const auto backend = choose_backend(arguments.flags.applied_to(arguments.backend), arguments.executor);
  arguments.flags.require_used();
  require_offers(*backend, arguments.backend, "validate");
  std::vector<std::pair<const validate::Case*, int>> runs;
  for (const validate::Case* which : chosen)
    for (const int resolution : resolutions_of(*which, arguments, backend->info().executor))
      runs.emplace_back(which, resolution);
  if (runs.empty())
    throw InputError("command line", "CASE", "none", "a case that this executor affords unasked; name a --resolution");
  std::vector<validate::Result> results;
  std::int64_t done = 0;
  int broken = 0, gates = 0, met = 0;
  const auto conclude = [&](const std::string& interrupted) {
    fmt::print("{}", validate::table(results));
    for (const auto& result : results)
      for (const auto& quantity : result.quantities) {
        gates += quantity.gated();
        met += quantity.gated() && quantity.met();
      }
    fmt::print("\n{} of {} gates met{}\n", met, gates, broken ? fmt::format("; {} broke down", broken) : "");
    if (!interrupted.empty()) fmt::print("{}\n", interrupted);
    std::fflush(stdout);
    if (!arguments.report.empty()) validate::write(arguments.report, results, interrupted);
  };
  Interruptible work([&] {
    if (!arguments.quiet) fmt::print(stderr, "\n");
    conclude(interrupted_line(done, static_cast<std::int64_t>(runs.size()), "runs judged"));
  });
  for (const auto& one : runs) {
    const validate::Case& which = *one.first;
    const int resolution = one.second;
    const Scene scene = validate::scene_of(which, resolution, fixtures / "scenes");
    Progress progress(fmt::format("{}/{} frame", which.name, resolution), scene.schedule.frames, 0, arguments.quiet);
    try {
      validate::Result result;
      work.part([&] {
        result = validate::run(which, resolution, scene, *backend, fixtures / "experiments",
                               [&](int frame) { progress.update(frame); });
      });
      results.push_back(std::move(result));
    } catch (const BackendError& trouble) {
      // The other cases still tell something.
      progress.pause();
      fmt::print(stderr, "decant: {}/{}: {}\n", which.name, resolution, trouble.what());
      ++broken;
    }
    ++done;
  }
  conclude("");
  exit_status = broken ? exit_failure : met == gates ? exit_pass : exit_does_not_conform;
}

}  // namespace

void add_validate_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<ValidateArguments>();
  CLI::App& verb =
      *app.add_subcommand("validate", "runs cases whose answer is known, analytic or measured, and judges the solver");
  verb.add_option("CASE", arguments->cases, "cases to run; all where none is named");
  verb.add_flag("--list", arguments->list, "prints the cases and ends");
  verb.add_option("--backend", arguments->backend,
                  "solver: reference, NAME[:OPTIONS], plugin:PATH or python:FILE:CLASS")
      ->capture_default_str();
  verb.add_option("--executor", arguments->executor, "cuda, host, or auto: the GPU where there is one")
      ->capture_default_str();
  verb.add_option("--resolution", arguments->resolutions,
                  "particles along the case's length, instead of its own resolutions")
      ->delimiter(',');
  verb.add_flag("--quick", arguments->quick, "one coarse resolution of the cases that run in seconds");
  verb.add_option("--report", arguments->report, "HDF5 file for figures and curves");
  verb.add_flag("--quiet", arguments->quiet, "no progress on standard error");
  arguments->flags.add_to(verb);
  verb.footer(validate_footer);
  verb.callback([arguments, &exit_status] { run(*arguments, exit_status); });
}

}  // namespace decant
