/// \file
/// `decant conform`: every asked-for backend on every asked-for fixture, a table, a report, a
/// status.
#include "oracle/checks/conform.hpp"
#include "oracle/checks/measured_reference.hpp"
#include "oracle/files/file_aside.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/report_file.hpp"
#include "oracle/report/console_table.hpp"
#include "reference/error.hpp"
#include "reference/scene_file.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/check_results_file.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/conform_run.hpp"
#include "tools/commands/fixture_folder.hpp"
#include "tools/commands/interruptible.hpp"
#include "tools/commands/junit.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/commands/report_json.hpp"
#include "tools/commands/reproducers.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/recording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace decant {
namespace {

struct ConformArguments {
  BackendFlags flags;
  std::vector<std::string> fixtures, backends, checks;
  std::string executor = "auto", report, junit, reproducers, explain;
  std::string results, oracle, name, select, kernel;
  int sample_every = 0, durations = 0;
  bool all = false, list = false, json = false, quiet = false, exit_first = false;
};

constexpr const char* conform_footer =
    "Without FIXTURE the small recordings beside the binary are judged (or those in the folder "
    "that\n"
    "DECANT_FIXTURES names), with --all every one. A check passes where no error exceeds its own\n"
    "tolerance: score = largest |error| / tolerance <= 1. Checks: fields, substep, contact, advanced,\n"
    "trajectory, mass, containment, determinism, conservation, invariance, status.\n"
    "Exit status: 0 all pass, 1 something does not conform, 2 bad input, 3 something could not "
    "run\n"
    "(a backend that breaks down while it is judged does not conform),\n"
    "77 the device of --executor is absent, 130 after Ctrl-C (143: SIGTERM): what was judged by then is in\n"
    "table and report, the rest is not_run.\n"
    "\n"
    "--results judges fields that were computed elsewhere: what is given must pass; what is not given\n"
    "is not_run in the report and leaves the exit status alone (3 where nothing is given).\n"
    "\n"
    "Example:\n"
    "  decant conform --backend brute --report build/conform.h5";

std::vector<Candidate> candidates_of(ConformArguments& arguments) {
  std::vector<std::string> names = arguments.backends;
  if (names.empty()) {
    names = backend_choices();
    std::erase(names, "reference");
  }
  if (names.empty()) throw InputError("command line", "--backend", "none", "this build has no backend under test");
  std::set<std::string> seen;
  std::vector<Candidate> candidates;
  for (const auto& name : names) {
    if (!seen.insert(name).second) throw InputError("command line", "--backend", name, "each backend once");
    candidates.push_back(candidate_of(arguments.flags.applied_to(name), arguments.executor));
  }
  arguments.flags.require_used();
  return candidates;
}

/// The reference where it is not ours: what --oracle names in place of a file.
std::unique_ptr<Backend> own_reference(const ConformArguments& arguments) {
  if (!names_backend(arguments.oracle)) return nullptr;
  std::unique_ptr<Backend> reference;
  try {
    reference = choose_backend(arguments.oracle, "auto");
  } catch (const InputError& error) {
    throw InputError(error.file(), error.key() == "--backend" ? "--oracle" : error.key(), error.value(), error.bound());
  }
  if (const std::string precision = reference->info().precision; precision != "fp64")
    throw InputError("command line", "--oracle", arguments.oracle,
                     fmt::format("a reference in fp64; this one computes in {}", precision));
  return reference;
}

CheckSelection checks_of(const ConformArguments& arguments) {
  const bool measured = names_backend(arguments.oracle);
  if (arguments.checks.empty()) return measured ? measured_checks() : all_checks();
  const CheckSelection checks = parse_checks(arguments.checks);
  for (const auto& check : checks)
    if (measured && !measured_checks().count(check))
      throw InputError("command line", "--check", check,
                       fmt::format("one of {} where --oracle names a solver: the others have derived bounds alone",
                                   fmt::join(measured_checks(), ", ")));
  return checks;
}

/// All are read before the first is judged: a bad one is refused before any work.
std::vector<Fixture> fixtures_of(const ConformArguments& arguments) {
  std::vector<std::filesystem::path> files;
  for (const auto& given : arguments.fixtures) files.push_back(recording_called(given));
  if (!files.empty() && arguments.all) throw InputError("command line", "--all", "given", "either --all or FIXTURE");
  if (files.empty()) files = fixtures_in(fixture_folder(), arguments.all);
  if (!arguments.select.empty()) {
    std::erase_if(files,
                  [&](const auto& file) { return file.stem().string().find(arguments.select) == std::string::npos; });
    if (files.empty())
      throw InputError("command line", "--select", arguments.select,
                       "part of a recording's name (decant conform --list)");
  }
  std::vector<Fixture> fixtures;
  for (const auto& file : files) fixtures.push_back(read_fixture(file));
  if (!arguments.kernel.empty()) {
    const auto known = std::ranges::find(kernel_names, arguments.kernel);
    if (known == kernel_names.end())
      throw InputError("command line", "--kernel", arguments.kernel,
                       fmt::format("one of {}", fmt::join(kernel_names, ", ")));
    const auto kernel = static_cast<KernelFamily>(known - kernel_names.begin());
    for (Fixture& fixture : fixtures) fixture = with_kernel(std::move(fixture), kernel);
  }
  return fixtures;
}

void add_provenance(Report& report, const std::vector<Candidate>& candidates, const std::vector<Fixture>& fixtures) {
  auto& p = report.provenance;
  p.merge(build_provenance());
  for (const auto& c : candidates)
    p["device." + c.info.name] = c.backend ? c.info.executor + ": " + c.info.device : c.why_not;
  for (const auto& f : fixtures) p["fixture_sha256." + f.name] = f.sha256;
}

/// 77 where nothing fails and all that is missing is the device that was asked for.
int status_of(const Report& report, const std::vector<Candidate>& candidates) {
  const int status = exit_status(report);
  const bool only_the_device = std::all_of(candidates.begin(), candidates.end(),
                                           [](const Candidate& c) { return c.backend || c.device_absent; });
  const bool absent =
      std::any_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.device_absent; });
  return status == exit_failure && absent && only_the_device ? exit_device_absent : status;
}

/// Names of all recordings with what decides whether a port can be asked about them; those of study scale marked.
int list_recordings() {
  const auto small = fixtures_in(fixture_folder(), false);
  for (const auto& file : fixtures_in(fixture_folder(), true)) {
    const Hdf5Reader in(file);
    const Scene scene = parse_scene(in.text("/scene"), file.string());
    std::string about = fmt::format("{}, {} particles", to_string(scene.kernel), in.shape("/state/position").at(0));
    if (const std::int64_t walls = in.integer_attribute("/walls", "count"))
      about += fmt::format(", {} at walls", walls);
    if (std::ranges::any_of(scene.domain.periodic, [](bool wraps) { return wraps; })) about += ", periodic";
    if (std::find(small.begin(), small.end(), file) == small.end()) about += "  (with --all)";
    fmt::print("{:<28}{}\n", file.stem().string(), about);
  }
  return exit_pass;
}

/// What a check compares, its bound and where that comes from, in lines a terminal holds.
int explain(const std::string& name) {
  const auto chosen = parse_checks({name});
  for (const auto& check : check_descriptions()) {
    if (!chosen.count(check.name)) continue;
    fmt::print("{}\n{}", check.name, wrapped(check.compares, 2));
    fmt::print("bound\n{}", wrapped(check.bound, 2));
    fmt::print("does not see\n{}", wrapped(check.blind, 2));
  }
  return exit_pass;
}

std::vector<ReproducerFile> wanted_reproducers(const ConformArguments& arguments, const Report& report) {
  return arguments.reproducers.empty() ? std::vector<ReproducerFile>() : reproducers_of(report, arguments.reproducers);
}

void write_reproducers(const std::vector<ReproducerFile>& reproducers, const Report& report,
                       const std::vector<Fixture>& fixtures, bool talks) {
  for (const ReproducerFile& reproducer : reproducers) {
    const CheckRow& row = report.rows[reproducer.row];
    const auto fixture =
        std::find_if(fixtures.begin(), fixtures.end(), [&](const Fixture& f) { return f.name == row.fixture; });
    std::filesystem::create_directories(reproducer.file.parent_path());
    std::string warning;
    const std::string line = write_reproducer(reproducer.file, *fixture, row, warning);
    if (talks) fmt::print("{}\n", line);
    if (!warning.empty()) fmt::print(stderr, "warning: {}: {}\n", reproducer.file.string(), warning);
  }
}

/// Prints what was asked for and writes the report.
int hand_over(const ConformArguments& arguments, const Report& report, const std::vector<ReproducerFile>& reproducers,
              int status, const std::string& table, const std::string& line) {
  if (arguments.json) fmt::print("{}\n", json_text(report, reproducers, line, status));
  else if (arguments.quiet) fmt::print("{}\n", line);
  else fmt::print("{}", table);
  std::fflush(stdout);
  // After the table: what was found out is not lost with a full disk.
  if (!arguments.report.empty()) write_report(arguments.report, report);
  if (!arguments.report.empty() && !arguments.json && !arguments.quiet)
    fmt::print("\nreport: {} (a page of it: tools/python/report_html.py)\n", arguments.report);
  if (!arguments.junit.empty()) write_text_file(arguments.junit, junit_xml(report));
  return status;
}

int conform_results(const ConformArguments& arguments) {
  if (names_backend(arguments.oracle))
    throw InputError("command line", "--oracle", arguments.oracle, "a file with --results; a solver with --backend");
  if (arguments.results.empty())
    throw InputError("command line", "--results", "not given", "required with --oracle and --name");
  if (!arguments.backends.empty() || arguments.all || arguments.executor != "auto" || !arguments.select.empty() ||
      arguments.exit_first || arguments.durations > 0 || !arguments.kernel.empty())
    throw InputError(
        "command line", "--results", arguments.results,
        "instead of --backend, --executor, --all, --select, --exitfirst, --durations and --kernel: nothing is run");
  if (!arguments.reproducers.empty() && !arguments.oracle.empty())
    throw InputError("command line", "--reproducers", arguments.reproducers,
                     "not with --oracle: a reproducer is cut out of a recording");
  arguments.flags.require_used();
  check_output_place("--report", arguments.report);
  check_output_folder("--reproducers", arguments.reproducers);
  std::vector<std::string> files;
  for (const auto& given : arguments.fixtures) files.push_back(recording_called(given).string());
  const ResultsOutcome outcome =
      check_results_file({arguments.results, files, arguments.oracle, arguments.name, arguments.checks});
  const auto reproducers = wanted_reproducers(arguments, outcome.report);
  hand_over(arguments, outcome.report, reproducers, outcome.status, outcome.table, outcome.line);
  write_reproducers(reproducers, outcome.report, outcome.fixtures, !arguments.quiet && !arguments.json);
  return outcome.status;
}

int conform(ConformArguments& arguments) {
  if (!arguments.explain.empty()) return explain(arguments.explain);
  if (arguments.list) return list_recordings();
  const bool own_oracle = names_backend(arguments.oracle) && arguments.results.empty();
  if (!arguments.results.empty() || (!arguments.oracle.empty() && !own_oracle) || !arguments.name.empty())
    return conform_results(arguments);
  const CheckSelection checks = checks_of(arguments);
  check_output_place("--report", arguments.report);
  check_output_place("--junit", arguments.junit);
  check_output_folder("--reproducers", arguments.reproducers);
  const auto own = own_reference(arguments);
  auto candidates = candidates_of(arguments);
  const auto fixtures = fixtures_of(arguments);
  const bool talks = !arguments.quiet && !arguments.json;
  Judged judged;
  Report& report = judged.report;
  if (own)
    report.provenance["oracle"] =
        fmt::format("{}: {}; bounds measured on {} copies", own->info().name, own->info().device, measured_copies);
  const auto hand_over_all = [&](int status, const std::vector<ReproducerFile>& reproducers, const std::string& more) {
    add_provenance(report, candidates, fixtures);
    hand_over(arguments, report, reproducers, status, "\n" + console_table(report) + more,
              verdict_line(report) + (more.empty() ? "" : "\n" + more.substr(0, more.size() - 1)));
  };
  Interruptible work([&] {
    add_what_was_not_judged(candidates, fixtures, "interrupted", judged);
    const auto all = static_cast<std::int64_t>(candidates.size() * fixtures.size());
    const std::string line = interrupted_line(judged.pairs, all, "judged");
    report.provenance["interrupted"] = line;
    if (talks) fmt::print(stderr, "\n");
    hand_over_all(Interruptible::exit_status(), {}, line + "\n");
  });
  if (talks && own) fmt::print("oracle: {}\n", report.provenance["oracle"]);
  if (talks)
    for (const auto& c : candidates)
      fmt::print("{}: {}\n", c.info.name,
                 c.backend ? fmt::format("{} on {}", c.info.executor, c.info.device) : c.why_not);
  std::fflush(stdout);
  const ConformRun run{fixtures, checks, own.get(), arguments.sample_every, arguments.exit_first, !talks};
  check_all(candidates, run, work, judged);
  add_what_was_not_judged(candidates, fixtures, "after the first failure (--exitfirst)", judged);
  const int status = status_of(report, candidates);
  const auto reproducers = wanted_reproducers(arguments, report);
  hand_over_all(status, reproducers, "");
  if (talks) fmt::print("{}", slowest(judged.seconds, arguments.durations));
  write_reproducers(reproducers, report, fixtures, talks);
  return status;
}

}  // namespace

void add_conform_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<ConformArguments>();
  CLI::App* verb = app.add_subcommand("conform", "judge backends on recorded states");
  verb->footer(conform_footer);
  verb->add_option("FIXTURE", arguments->fixtures, "recordings, by file or by name; default: the small ones");
  verb->add_flag("--all", arguments->all, "the study-scale recordings too");
  verb->add_option("-k,--select", arguments->select, "of the recordings those with this in their names");
  verb->add_flag("-x,--exitfirst", arguments->exit_first, "stop after the first recording and backend that fail");
  verb->add_option("--durations", arguments->durations, "print the so many slowest pairs of backend and recording")
      ->check(CLI::Range(1, 10000));
  verb->add_option("--kernel", arguments->kernel,
                   "judge the recorded states with this kernel in place of their own: cubic_spline, wendland_c2 or "
                   "mueller2003");
  verb->add_flag("--list", arguments->list,
                 "print all recordings with kernel, particles, walls, periods; judges nothing");
  verb->add_option("--backend", arguments->backends, "brute,…, plugin:PATH, python:FILE:CLASS; default: all under test")
      ->delimiter(',')
      ->allow_extra_args(false);
  verb->add_option("--executor", arguments->executor, "auto, cuda or host")->capture_default_str();
  verb->add_option("--check", arguments->checks, "fields,substep,…; default: all")
      ->delimiter(',')
      ->allow_extra_args(false);
  verb->add_option("--explain", arguments->explain,
                   "say what a check compares and why its bound is what it is; judges nothing");
  arguments->flags.add_to(*verb);
  verb->add_option("--results", arguments->results,
                   "judge this file's fields (oracle/formats/results.md) instead of a backend");
  verb->add_option("--oracle", arguments->oracle,
                   "a reference of one's own: a file, for --results of one's own states; or a solver in fp64, "
                   "plugin:PATH or python:FILE:CLASS, whose bounds are measured");
  verb->add_option("--name", arguments->name, "what the report calls --results; default: its file");
  verb->add_option("--check-every", arguments->sample_every,
                   "check mass and containment every so many substeps of a run; 1 names the first "
                   "substep; default: at ever shorter intervals")
      ->check(CLI::Range(1, 1000000));
  verb->add_option("--look-every", arguments->sample_every)->check(CLI::Range(1, 1000000))->group("");
  verb->add_option("--report", arguments->report, "write an HDF5 report");
  verb->add_option("--junit", arguments->junit, "write JUnit XML, for CI");
  verb->add_option("--surroundings", arguments->reproducers)->group("");
  verb->add_option("--reproducers", arguments->reproducers,
                   "folder for fixtures of the fluid around failing particles");
  verb->add_flag("--json", arguments->json, "rows as JSON instead of the table");
  verb->add_flag("--quiet", arguments->quiet, "the verdict's line alone");
  verb->callback([arguments, &exit_status] { exit_status = conform(*arguments); });
}

}  // namespace decant
