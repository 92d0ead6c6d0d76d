/// \file
/// Whether the tolerances are what they claim to be, measured.
///
/// scores    every backend on thousands of random cases: how errors are spread below their tolerances.
///           A correct backend above 1 is a false alarm; a median below 0.01 is a bound too loose.
/// forms     every legal way to write the fields in fp32, on recordings and random cases: none may exceed a
///           tolerance.
/// ensemble  thousands of perturbed runs of the oracle against the bound of the recorded ensemble: how
///           often a correct run would be called wrong; and a viscosity wrong by 1 % against the same.
/// coverage  which values of which keys of a scene the recordings and fuzzed problems have.
#include "gpu/backends.hpp"
#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "reference/sampling.hpp"
#include "tests/random_scene.hpp"
#include "tests/scene_coverage.hpp"
#include "tests/studies/forms.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <omp.h>
#include <CLI/CLI.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>

namespace decant {
namespace {

struct Settings {
  std::vector<std::string> backends = {"brute", "hash", "list"}, fixtures;
  std::string executor = "host", out;
  std::uint32_t first = 1, cases = 10000;
  std::int64_t members = 1000;
  int processes = 2, problems = 1000, tries = 4;
};

/// Lines of task(k) for all k < count, from several processes; a backend that crashes takes none but its
/// own along. Throws where a process did not end well.
template <class Task>
std::vector<std::string> spread(int processes, std::uint32_t count, Task task) {
  std::vector<std::FILE*> results;
  std::vector<pid_t> children;
  for (int p = 0; p < processes; ++p) {
    results.push_back(std::tmpfile());
    const pid_t pid = fork();
    if (pid == 0) {
      omp_set_num_threads(1);
      for (auto k = static_cast<std::uint32_t>(p); k < count; k += static_cast<std::uint32_t>(processes))
        fmt::print(results.back(), "{}", task(k));
      std::fflush(results.back());
      _exit(0);
    }
    children.push_back(pid);
  }
  std::vector<std::string> lines;
  for (std::size_t p = 0; p < children.size(); ++p) {
    int status = 0;
    waitpid(children[p], &status, 0);
    if (status != 0) throw std::runtime_error(fmt::format("process {} ended with {}", p, status));
    std::rewind(results[p]);
    std::string line;
    for (int c; (c = std::fgetc(results[p])) != EOF;) {
      if (c != '\n') {
        line += static_cast<char>(c);
        continue;
      }
      lines.push_back(line);
      line.clear();
    }
    std::fclose(results[p]);
  }
  return lines;
}

int finish(const Settings& s, const std::string& text, bool holds) {
  std::cout << text;
  if (!s.out.empty()) std::ofstream(s.out) << text;
  return holds ? 0 : 1;
}

double quantile(std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

/// What one kind of row showed over all cases.
struct Spread {
  std::vector<double> largest, median;  // of a case's values
  std::int64_t values = 0;
  std::uint32_t worst_case = 0;
  double worst = -1;
};

/// A line for every row: check, field, backend, values, largest and median score, verdict.
std::string judged_case(const Settings& s, Executor executor, std::uint32_t seed) {
  const CheckSelection checks{"fields", "substep", "conservation"};
  Fixture fixture = test::random_fixture(seed);
  // A state that fp32 cannot judge at all is no case; `record` warns of those.
  if (!evaluate_oracle(fixture.scene, fixture.state, fixture.fields.emplace(), fixture.condition.emplace()).empty())
    return {};
  const PreparedReference oracle = prepare_reference(fixture, checks);
  std::string lines;
  for (const auto& name : s.backends)
    for (CheckRow& row : run_checks(*make_backend(name, executor), fixture, oracle, checks)) {
      condense(row);
      lines += fmt::format("{} {} {} {} {} {} {} {}\n", row.check, row.field.empty() ? "-" : row.field, name, seed,
                           row.n, row.score, row.median_score, to_string(verdict_of(row)));
    }
  return lines;
}

int scores(const Settings& s) {
  const Executor executor = s.executor == "cuda" ? Executor::cuda : Executor::host;
  std::map<std::vector<std::string>, Spread> all;  // check, field, backend
  std::int64_t alarms = 0;
  std::string false_alarms;
  std::set<std::uint32_t> judged;
  for (const auto& line :
       spread(s.processes, s.cases, [&](std::uint32_t k) { return judged_case(s, executor, s.first + k); })) {
    std::istringstream columns(line);
    std::string check, field, name, score, median, verdict;
    std::uint32_t seed = 0;
    std::int64_t n = 0;
    columns >> check >> field >> name >> seed >> n >> score >> median >> verdict;
    judged.insert(seed);
    if (verdict != "pass") {
      ++alarms;
      false_alarms += fmt::format("seed {}: {} {} / {}: score {}\n", seed, name, check, field, score);
    }
    Spread& to = all[{check, field, name}];
    to.largest.push_back(std::stod(score));
    to.median.push_back(std::stod(median));
    to.values += n;
    if (to.largest.back() > to.worst) {
      to.worst = to.largest.back();
      to.worst_case = seed;
    }
  }
  std::string text = fmt::format(
      "{} random cases of seeds {} to {}, executor {} on {}\n"
      "score = |error| / tolerance. Largest of a case: median, 99th percentile, largest of all and its\n"
      "seed; median of a case's values: median over the cases.\n\n"
      "{:<16} {:<27} {:<6} {:>11} {:>8} {:>8} {:>8} {:>8} {:>8}\n",
      judged.size(), s.first, s.first + s.cases - 1, s.executor, executor_device(executor), "check", "field", "",
      "values", "median", "p99", "largest", "seed", "typical");
  for (auto& [key, spread] : all) {
    std::sort(spread.largest.begin(), spread.largest.end());
    std::sort(spread.median.begin(), spread.median.end());
    text += fmt::format("{:<16} {:<27} {:<6} {:>11} {:>8.3f} {:>8.3f} {:>8.3f} {:>8} {:>8.4f}\n", key[0], key[1],
                        key[2], spread.values, quantile(spread.largest, 0.5), quantile(spread.largest, 0.99),
                        spread.worst, spread.worst_case, quantile(spread.median, 0.5));
  }
  text += "\n" + false_alarms + fmt::format("{} scores above 1\n", alarms);
  return finish(s, text, alarms == 0);
}

int forms(const Settings& s) {
  const auto count = static_cast<std::uint32_t>(s.fixtures.size()) + s.cases;
  const FormsTable table = table_of_forms(
      spread(s.processes, count, [&](std::uint32_t k) { return lines_of_forms(s.fixtures, k, s.first, s.tries); }));
  const std::string text = fmt::format(
      "Legal forms of every operation in fp32 on {} recordings and random cases of seeds {} to {},\n"
      "{} sets of forms each, drawn at random; score = |error| / tolerance; {} problems with particles.\n\n",
      s.fixtures.size(), s.first, s.first + s.cases - 1, s.tries, table.problems);
  return finish(s, text + table.text, table.above == 0);
}

int ensemble(const Settings& s) {
  std::string text = fmt::format(
      "Perturbed runs of the oracle against the bound 3 (mean + 6 deviations) of the recorded ensemble.\n"
      "Divergence over bound: median and largest of {} runs by other numbers; false alarms; the same of one\n"
      "run with viscosity × 1.01, caught where above 1.\n\n{:<28} {:<13} {:>8} {:>8} {:>7} {:>9}\n",
      s.members, "fixture", "measure", "median", "largest", "alarms", "viscosity");
  std::int64_t alarms = 0, runs = 0;
  bool caught = false;
  for (const auto& file : s.fixtures) {
    const Fixture fixture = read_fixture(file);
    const Walls walls = sample_walls(fixture.scene);
    const auto substeps = fixture.ensemble.substeps;
    const Divergence bound = divergence_bound(fixture.ensemble);
    const ParticleState unperturbed = run_oracle(fixture.scene, walls, fixture.state, substeps);
    std::vector<Divergence> apart;
    for (const auto& line : spread(s.processes, static_cast<std::uint32_t>(s.members), [&](std::uint32_t k) {
           const Divergence d = divergence(
               fixture.scene, run_perturbed(fixture.scene, walls, fixture.state, substeps, 1000 + k), unperturbed);
           return fmt::format("{}\n", fmt::join(d, " "));
         })) {
      std::istringstream columns(line);
      for (double& measure : apart.emplace_back()) columns >> measure;
    }
    Scene thicker = fixture.scene;
    thicker.fluid.viscosity *= 1.01;
    const Divergence wrong =
        divergence(fixture.scene, run_oracle(thicker, walls, fixture.state, substeps), unperturbed);
    std::vector<bool> alarmed(apart.size());
    for (std::size_t m = 0; m < bound.size(); ++m) {
      std::vector<double> share;
      std::int64_t above = 0;
      for (std::size_t k = 0; k < apart.size(); ++k) {
        share.push_back(apart[k][m] / bound[m]);
        if (!(share.back() <= 1)) {
          ++above;
          alarmed[k] = true;
        }
      }
      std::sort(share.begin(), share.end());
      caught = caught || wrong[m] > bound[m];
      text += fmt::format("{:<28} {:<13} {:>8.3f} {:>8.3f} {:>7} {:>9.3g}\n", fixture.name, divergence_names[m],
                          quantile(share, 0.5), share.back(), above, wrong[m] / bound[m]);
    }
    alarms += std::count(alarmed.begin(), alarmed.end(), true);
    runs += s.members;
  }
  text += fmt::format("\n{} of {} runs called wrong; viscosity × 1.01 {}\n", alarms, runs,
                      caught ? "caught" : "NOT CAUGHT");
  return finish(s, text, alarms * 1000 < runs && caught);
}

/// Every key of a scene against every recording and the fuzzed problems.
int coverage(const Settings& s) {
  const auto keys = test::leaf_keys_of_scenes();
  const test::Coverage fixtures = test::coverage_of_fixtures(), fuzzing = test::coverage_of_fuzzing(s.problems);
  return finish(s, test::coverage_table(fixtures, fuzzing), fixtures.gaps(keys).empty() && fuzzing.gaps(keys).empty());
}

}  // namespace
}  // namespace decant

int main(int argc, char** argv) {
  decant::Settings s;
  CLI::App app("Studies of the tolerances.");
  app.require_subcommand(1);
  CLI::App* scores = app.add_subcommand("scores", "random cases");
  CLI::App* forms = app.add_subcommand("forms", "legal forms of fp32");
  CLI::App* ensemble = app.add_subcommand("ensemble", "perturbed runs");
  scores->add_option("--cases", s.cases)->capture_default_str();
  scores->add_option("--first", s.first, "first seed")->capture_default_str();
  scores->add_option("--backend", s.backends)->delimiter(',')->capture_default_str();
  scores->add_option("--executor", s.executor)->check(CLI::IsMember({"host", "cuda"}));
  forms->add_option("FIXTURE", s.fixtures);
  forms->add_option("--cases", s.cases)->capture_default_str();
  forms->add_option("--first", s.first, "first seed")->capture_default_str();
  forms->add_option("--tries", s.tries, "sets of forms per problem")->capture_default_str();
  ensemble->add_option("FIXTURE", s.fixtures)->required();
  ensemble->add_option("--members", s.members, "runs a fixture")->capture_default_str();
  CLI::App* coverage = app.add_subcommand("coverage", "keys of scenes in recordings and in fuzzing");
  coverage->add_option("--problems", s.problems, "fuzzed ones")->capture_default_str();
  coverage->add_option("--out", s.out, "write the table");
  for (CLI::App* verb : {scores, forms, ensemble}) {
    verb->add_option("--processes", s.processes)->capture_default_str();
    verb->add_option("--out", s.out, "write the table");
  }
  CLI11_PARSE(app, argc, argv);
  try {
    if (*forms) return decant::forms(s);
    return *scores ? decant::scores(s) : *coverage ? decant::coverage(s) : decant::ensemble(s);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
