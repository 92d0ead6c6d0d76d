/// \file
/// Judges every planted fault of an altered copy of gpu/ (plant.py) and says which checks caught it.
/// Each runs in a process of its own, so that one that crashes or hangs is one more that was caught.
/// Exit status: 0 every fault caught by the check that is there for it and the backends without a fault
/// pass; 1 otherwise; 2 bad input.
#include "tests/faults/fuzz_faults.hpp"
#include "tests/faults/held_out.hpp"
#include "tests/faults/trials.hpp"

#include <fmt/format.h>
#include <omp.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>
#include <tuple>

namespace decant {
namespace {

struct Settings {
  std::string list, folder = "fixtures", executor = "host", out, equivalent;
  std::vector<std::string> only;
  int jobs = 2;
  bool verbose = false, named_checks = false;
  std::int64_t fuzz = 0;  // problems at most; 0: the catalogue's own fixtures
  std::uint64_t first_seed = 1;
};

int finish(const Settings& s, const std::string& table, bool passes) {
  std::cout << table;
  if (!s.out.empty()) std::ofstream(s.out) << table;
  return passes ? 0 : 1;
}

/// What has to run to give rows of this name.
CheckSelection selection_of(const std::string& row) {
  const std::string check = check_of_row(row);
  return check.empty() ? all_checks() : CheckSelection{check};
}

/// The catalogue: each fault against the check that is there for it.
int run_catalogue(const Settings& s, const nlohmann::json& faults, Executor executor) {
  std::vector<Trial> trials;
  std::vector<nlohmann::json> planted;
  std::size_t not_run = 0;
  for (const auto& f : faults) {
    if (!s.only.empty() && std::count(s.only.begin(), s.only.end(), text(f, "name")) == 0) continue;
    if (f["on"] == "cuda" && executor != Executor::cuda) {
      ++not_run;
      continue;
    }
    trials.push_back({number(f), text(f, "backend"), text(f, "fixture"),
                      s.named_checks ? selection_of(text(f, "check")) : all_checks()});
    planted.push_back(f);
  }
  const auto prepared = prepare_all(trials, s.folder);
  const auto outcomes = run_all(trials, executor, s.jobs, prepared);
  std::string table = fmt::format("{:<26} {:<17} {:<16} {:>9}  {}\n", "fault", "backend", "check", "factor",
                                  "what is wrong; what fails besides");
  std::size_t caught = 0, near = 0, equivalent = 0, reasons = 0;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const Outcome& o = outcomes[t];
    const std::string check = text(planted[t], "check");
    const auto hit = o.failed.find(check);
    if (const std::string reason = why_equivalent(planted[t]); !reason.empty()) {
      ++reasons;
      equivalent += !o.caught;
      table += fmt::format("{:<26} {:<17} {:<16} {:>9}  {}; {}\n", text(planted[t], "name"), trials[t].backend, "",
                           o.caught ? "SHOWS" : "same", text(planted[t], "what"), reason);
      continue;
    }
    caught += hit != o.failed.end();
    near += hit != o.failed.end() && hit->second < 10;
    const std::string factor = hit == o.failed.end()  ? o.caught ? "ELSEWHERE" : "MISSED"
                               : !(hit->second < 1e6) ? "no bound"
                                                      : fmt::format("{:.3g}", hit->second);
    const std::string others = joined(o.failed, check);
    table += fmt::format("{:<26} {:<17} {:<16} {:>9}  {}; {}\n", text(planted[t], "name"), trials[t].backend, check,
                         factor, text(planted[t], "what"),
                         !o.ended.empty() ? o.ended
                         : others.empty() ? "nothing"
                                          : others);
  }
  for (const auto& f : faults)
    if (s.only.empty() && f["on"] == "cuda" && executor != Executor::cuda)
      table += fmt::format("{:<26} {:<17} {:<16} {:>9}  {}\n", text(f, "name"), text(f, "backend"), text(f, "check"),
                           "not_run", text(f, "what"));
  const std::string wrong = failures_without_fault(clean(trials), executor, s.jobs, prepared);
  const std::size_t faulty = trials.size() - reasons;
  table += wrong + fmt::format(
                       "{} of {} caught by the check that is there for it, {} by a factor below 10; "
                       "{} of {} that change nothing show nothing; {} not_run here; without a fault {}\n",
                       caught, faulty, near, equivalent, reasons, not_run, wrong.empty() ? "all pass" : "SOME FAIL");
  return finish(s, table, caught == faulty && equivalent == reasons && wrong.empty());
}

/// What a mutation is tried on, until something fails.
const std::vector<std::pair<std::string, std::string>>& attempts() {
  static const std::vector<std::pair<std::string, std::string>> all = {
      {"list", "pour-4k-stream"},
      {"hash", "pour-4k-settled"},
      {"hash", "hostile-periodic"},
      {"list", "hostile-periodic"},
      {"hash", "hostile-crowd"},
      {"hash", "hostile-coincident"},
      {"hash", "hostile-in-walls"},
      {"list", "hostile-periodic-box"},
      {"list:tiles=on", "pour-4k-stream"},
      {"list:skin=0.05", "pour-4k-splash"},
      {"list:criterion=relative:skin=0.05", "pour-4k-splash"},
      {"hash:moving_walls=rebuilt:sort=thrust", "pour-4k-stream"},
      {"hash:force_neighbors=recomputed:wall_cells=off", "pour-4k-stream"},
      {"list:build=all-pairs", "hostile-exact-support"},
      {"brute", "pour-4k-stream"},
      {"brute", "hostile-periodic"},
      {"brute", "hostile-exact-support"},
      {"hash", "hostile-exact-support"},
      {"hash", "hostile-outliers"},
      {"hash", "pour-4k-rest"},
  };
  return all;
}

/// Mutations: each must be caught by anything, or stand in the file of equivalent ones with a reason.
int run_mutations(const Settings& s, const nlohmann::json& faults, Executor executor) {
  nlohmann::json equivalent = nlohmann::json::object();
  if (!s.equivalent.empty()) std::ifstream(s.equivalent) >> equivalent;
  std::vector<std::string> by(faults.size());
  std::vector<Trial> used;
  for (const auto& [backend, fixture] : attempts()) used.push_back({0, backend, fixture});
  const auto prepared = prepare_all(used, s.folder);
  // Most show at once in the fields; only what does not is worth runs.
  std::vector<std::tuple<std::string, std::string, CheckSelection>> rounds;
  for (const auto& [backend, fixture] : attempts())
    rounds.emplace_back(backend, fixture, CheckSelection{"fields", "substep"});
  for (const auto& [backend, fixture] : attempts())
    if (fixture.starts_with("hostile-") || backend == "list:skin=0.05")
      rounds.emplace_back(backend, fixture, all_checks());
  for (const auto& [backend, fixture, checks] : rounds) {
    std::vector<Trial> trials;
    std::vector<std::size_t> which;
    for (std::size_t k = 0; k < faults.size(); ++k) {
      if (!by[k].empty()) continue;
      if (faults[k]["file"] == "backends/brute_force.cu" && backend != "brute") continue;
      trials.push_back({number(faults[k]), backend, fixture, checks});
      which.push_back(k);
    }
    const auto outcomes = run_all(trials, executor, s.jobs, prepared);
    if (s.verbose) {
      std::cerr << fmt::format("{} on {}: {} left\n", backend, fixture, trials.size());
      for (const auto k : which) std::cerr << "  " << text(faults[k], "name") << '\n';
    }
    for (std::size_t t = 0; t < trials.size(); ++t)
      if (outcomes[t].caught)
        by[which[t]] = fmt::format("{}, {}: {}", backend, fixture,
                                   outcomes[t].ended.empty() ? joined(outcomes[t].failed, "") : outcomes[t].ended);
  }
  std::size_t caught = 0, explained = 0;
  std::string table;
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const std::string line = text(faults[k], "line"), what = text(faults[k], "what");
    std::string verdict = by[k];
    if (!verdict.empty()) {
      ++caught;
    } else if (equivalent.contains(line) && equivalent[line].contains(what)) {
      verdict = "equivalent: " + equivalent[line][what].get<std::string>();
      ++explained;
    } else {
      verdict = "SURVIVES";
    }
    table += fmt::format("{:<24} {}: {}\n{:<24} {}\n", text(faults[k], "name"), what, line, "", verdict);
  }
  const std::string wrong = failures_without_fault(used, executor, s.jobs, prepared);
  table += wrong + fmt::format(
                       "{} mutations: {} caught, {} equivalent with a reason, {} survive; without a "
                       "mutation {}\n",
                       faults.size(), caught, explained, faults.size() - caught - explained,
                       wrong.empty() ? "all pass" : "SOME FAIL");
  return finish(s, table, caught + explained == faults.size() && wrong.empty());
}

int run(const Settings& s) {
  const Executor executor = s.executor == "cuda" ? Executor::cuda : Executor::host;
  nlohmann::json faults;
  std::ifstream(s.list) >> faults;
  // One thread a process; nobody has threads when processes split off.
  omp_set_num_threads(1);
  if (s.fuzz > 0) {
    bool all_found = false;
    const std::string table = fuzz_faults(faults, executor, s.jobs, s.fuzz, s.first_seed, all_found);
    return finish(s, table, all_found);
  }
  if (!faults.empty() && faults[0].contains("shows")) {
    bool all_caught = false;
    const std::string table = check_held_out(faults, executor, s.jobs, s.folder, s.only, all_caught);
    return finish(s, table, all_caught);
  }
  const bool mutations = !faults.empty() && !faults[0].contains("check");
  return mutations ? run_mutations(s, faults, executor) : run_catalogue(s, faults, executor);
}

}  // namespace
}  // namespace decant

int main(int argc, char** argv) {
  decant::Settings s;
  CLI::App app("Judges the planted faults, or the mutations, of an altered build.");
  app.add_option("LIST", s.list, "faults.json of plant.py")->required();
  app.add_option("--fixtures", s.folder, "folder of recordings")->capture_default_str();
  app.add_option("--executor", s.executor, "host or cuda")->check(CLI::IsMember({"host", "cuda"}));
  app.add_option("--jobs", s.jobs, "processes at a time")->capture_default_str();
  app.add_option("--only", s.only, "names of faults");
  app.add_flag("--named-checks", s.named_checks, "run of each fault's checks only the one that is there for it");
  app.add_option("--equivalent", s.equivalent, "mutations that change nothing, with reasons");
  app.add_option("--fuzz", s.fuzz, "find each fault by fuzzing alone, in so many problems at most");
  app.add_option("--seed", s.first_seed, "of the first problem");
  app.add_flag("--verbose", s.verbose, "say how far it is");
  app.add_option("--out", s.out, "write the table");
  CLI11_PARSE(app, argc, argv);
  try {
    return decant::run(s);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
