/// \file
/// `decant conform`: every asked-for backend on every asked-for fixture, a table, a report, a
/// status.
#include "oracle/checks/conform.hpp"
#include "oracle/checks/measured_reference.hpp"
#include "oracle/checks/neighborhood.hpp"
#include "oracle/files/file_aside.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/report_file.hpp"
#include "oracle/report/console_table.hpp"
#include "reference/error.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/check_results_file.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/fixture_folder.hpp"
#include "tools/commands/interruptible.hpp"
#include "tools/commands/junit.hpp"
#include "tools/commands/output_place.hpp"
#include "tools/commands/reproducers.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/progress.hpp"
#include "tools/common/recording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <future>
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

// Of what a report shows around its first failing particle, in H.
constexpr double shown_radius = 6;

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

/// A backend that was asked for, or why it is not there.
struct Candidate {
  std::unique_ptr<Backend> backend;
  BackendInfo info;
  std::string why_not;
  bool device_absent = false;
};

Candidate candidate_of(const std::string& name, const std::string& executor) {
  Candidate c;
  c.info.name = name;
  c.info.executor = executor;
  try {
    c.backend = choose_backend(name, executor);
    c.info = c.backend->info();
  } catch (const DeviceAbsent& error) {
    c.why_not = error.what();
    c.device_absent = true;
  } catch (const BackendError& error) {
    c.why_not = error.what();
  }
  return c;
}

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
  std::unique_ptr<Backend> reference = choose_backend(arguments.oracle, "auto");
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

CheckRow row_that_did_not_run(const Candidate& candidate, const Fixture& fixture, const std::string& why) {
  CheckRow row;
  row.backend = candidate.info.name;
  row.executor = candidate.info.executor;
  row.device = candidate.info.device;
  row.fixture = fixture.name;
  row.check = "all";
  row.reason = why;
  return row;
}

/// What the reference says of one fixture, or why it says nothing.
struct Prepared {
  std::unique_ptr<const PreparedReference> oracle;
  std::string why_not;
};

Prepared prepared_for(const Fixture& fixture, const CheckSelection& checks, int sample_every, Backend* own) {
  if (!own) return {std::make_unique<const PreparedReference>(prepare_reference(fixture, checks, sample_every)), ""};
  try {
    return {std::make_unique<const PreparedReference>(measured_reference(*own, fixture, checks, sample_every)), ""};
  } catch (const BackendError& error) {
    return {nullptr, error.what()};
  }
}

/// Adds the rows of all, pair by pair, until one fails where that is asked for. \param own  the reference, or null:
/// ours. \param judged  pairs of backend and
/// fixture whose rows are there; \param seconds  what each took, by its name
void check_all(std::vector<Candidate>& candidates, const std::vector<Fixture>& fixtures, const CheckSelection& checks,
               const ConformArguments& arguments, Backend* own, bool quiet, Interruptible& work, Report& report,
               std::int64_t& judged, std::vector<std::pair<double, std::string>>& seconds) {
  using Clock = std::chrono::steady_clock;
  const auto total = static_cast<std::int64_t>(candidates.size() * fixtures.size());
  const bool any =
      std::any_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.backend != nullptr; });
  Progress progress("check", total, 0, quiet);
  // The oracle is sequential: it works on the next fixture while backends are judged on this one.
  const auto prepared = [&](std::size_t k) {
    return std::async(std::launch::async,
                      [&, k] { return prepared_for(fixtures[k], checks, arguments.sample_every, own); });
  };
  std::future<Prepared> next;
  if (any && !fixtures.empty()) next = prepared(0);
  for (std::size_t k = 0; k < fixtures.size(); ++k) {
    const Fixture& fixture = fixtures[k];
    Prepared reference;
    if (any) work.part([&] { reference = next.get(); });
    const auto& oracle = reference.oracle;
    if (any && k + 1 < fixtures.size()) next = prepared(k + 1);
    for (Candidate& candidate : candidates) {
      progress.update(judged, fixture.name + " " + candidate.info.name);
      if (!candidate.backend || !oracle) {
        report.rows.push_back(
            row_that_did_not_run(candidate, fixture, candidate.backend ? reference.why_not : candidate.why_not));
        ++judged;
        continue;
      }
      std::vector<CheckRow> rows;
      const auto start = Clock::now();
      work.part([&] {
        rows = run_checks(*candidate.backend, fixture, *oracle, checks);
        for (CheckRow& row : rows) condense(row);
      });
      seconds.emplace_back(std::chrono::duration<double>(Clock::now() - start).count(),
                           candidate.info.name + " " + fixture.name);
      bool fails = false;
      for (CheckRow& row : rows) {
        fails |= verdict_of(row) == Verdict::fail;
        if (!report.neighborhood && is_located(row))
          report.neighborhood = neighborhood_of(fixture, oracle->walls, oracle->own.fields.density, row,
                                                static_cast<std::int64_t>(report.rows.size()),
                                                shown_radius * fixture.scene.support_radius());
        report.rows.push_back(std::move(row));
      }
      ++judged;
      if (fails && arguments.exit_first) return;
    }
  }
  progress.update(total);
}

/// The slowest pairs of backend and fixture, one per line.
std::string slowest(std::vector<std::pair<double, std::string>> seconds, int most) {
  std::sort(seconds.rbegin(), seconds.rend());
  std::string text;
  for (std::size_t k = 0; k < seconds.size() && k < static_cast<std::size_t>(most); ++k)
    text += fmt::format("{:8.2f} s  {}\n", seconds[k].first, seconds[k].second);
  return text.empty() ? text : "\nslowest, without the reference\n" + text;
}

/// What was asked for and is not there is in the report too.
void add_what_was_not_judged(const std::vector<Candidate>& candidates, const std::vector<Fixture>& fixtures,
                             std::int64_t judged, const std::string& why, Report& report) {
  std::int64_t pair = 0;
  for (const Fixture& fixture : fixtures)
    for (const Candidate& candidate : candidates)
      if (pair++ >= judged) report.rows.push_back(row_that_did_not_run(candidate, fixture, why));
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

std::string json_text(const Report& report, const std::vector<ReproducerFile>& reproducers, const std::string& line,
                      int status) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array(), files = rows;
  for (const auto& r : report.rows)
    rows.push_back({{"backend", r.backend},
                    {"options", r.options},
                    {"executor", r.executor},
                    {"device", r.device},
                    {"fixture", r.fixture},
                    {"check", r.check},
                    {"field", r.field},
                    {"unit", r.unit},
                    {"n", r.n},
                    {"error", r.error},
                    {"tolerance", r.tolerance},
                    {"score", r.score},
                    {"median_score", r.median_score},
                    {"fp32_reference_score", r.fp32_reference_score},
                    {"worst_id", r.worst_id},
                    {"worst_component", r.worst_component},
                    {"actual", r.actual},
                    {"expected", r.expected},
                    {"worst_position", {r.worst_x, r.worst_y, r.worst_z}},
                    {"fluid_neighbors", r.fluid_neighbors},
                    {"wall_neighbors", r.wall_neighbors},
                    {"nearest", r.nearest},
                    {"excluded", r.excluded},
                    {"verdict", to_string(verdict_of(r))},
                    {"reason", reason_of(r)}});
  for (const auto& reproducer : reproducers)
    files.push_back({{"row", reproducer.row}, {"file", reproducer.file.string()}});
  const nlohmann::ordered_json all = {{"summary", line},
                                      {"exit_status", status},
                                      {"rows", rows},
                                      {"reproducers", files},
                                      {"provenance", report.provenance}};
  return all.dump(2);
}

/// Names of all recordings, those of study scale marked.
int list_recordings() {
  const auto small = fixtures_in(fixture_folder(), false);
  for (const auto& file : fixtures_in(fixture_folder(), true))
    fmt::print("{}{}\n", file.stem().string(),
               std::find(small.begin(), small.end(), file) == small.end() ? "  (with --all)" : "");
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
  Report report;
  std::int64_t judged = 0;
  if (own)
    report.provenance["oracle"] =
        fmt::format("{}: {}; bounds measured on {} copies", own->info().name, own->info().device, measured_copies);
  const auto hand_over_all = [&](int status, const std::vector<ReproducerFile>& reproducers, const std::string& more) {
    add_provenance(report, candidates, fixtures);
    hand_over(arguments, report, reproducers, status, "\n" + console_table(report) + more,
              verdict_line(report) + (more.empty() ? "" : "\n" + more.substr(0, more.size() - 1)));
  };
  Interruptible work([&] {
    add_what_was_not_judged(candidates, fixtures, judged, "interrupted", report);
    const auto all = static_cast<std::int64_t>(candidates.size() * fixtures.size());
    const std::string line = interrupted_line(judged, all, "judged");
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
  std::vector<std::pair<double, std::string>> seconds;
  check_all(candidates, fixtures, checks, arguments, own.get(), !talks, work, report, judged, seconds);
  add_what_was_not_judged(candidates, fixtures, judged, "after the first failure (--exitfirst)", report);
  const int status = status_of(report, candidates);
  const auto reproducers = wanted_reproducers(arguments, report);
  hand_over_all(status, reproducers, "");
  if (talks) fmt::print("{}", slowest(seconds, arguments.durations));
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
  verb->add_flag("--list", arguments->list, "print the names of all recordings; judges nothing");
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
