/// \file
/// Recordings in the order of their size, so that most faults cost little.
#include "tests/faults/held_out.hpp"

#include "oracle/files/fixture_file.hpp"
#include "tests/faults/trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <compare>

namespace decant {
namespace {

struct Recording {
  Eigen::Index particles;
  std::string name;
  auto operator<=>(const Recording&) const = default;

  /// Brute force shares all but its search with the others, and takes a hundred times as long where there
  /// are many.
  std::vector<std::string> backends() const {
    if (particles < 2000) return {"brute", "hash", "list"};
    return {"hash", "list"};
  }
};

/// The recordings that hold all fields, the smallest first.
std::vector<Recording> small_fixtures(const std::filesystem::path& folder) {
  std::vector<Recording> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".h5") continue;
    const Fixture fixture = read_fixture(entry.path());
    if (fixture.fields) found.push_back({fixture.state.size(), entry.path().stem().string()});
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::string check_held_out(const nlohmann::json& faults, Executor executor, int jobs,
                           const std::filesystem::path& folder, const std::vector<std::string>& only,
                           bool& all_caught) {
  std::vector<nlohmann::json> planted;
  std::size_t not_run = 0;
  for (const auto& f : faults) {
    if (!only.empty() && std::count(only.begin(), only.end(), text(f, "name")) == 0) continue;
    if (text(f, "on") == "cuda" && executor != Executor::cuda) ++not_run;
    else planted.push_back(f);
  }
  const std::vector<Recording> fixtures = small_fixtures(folder);
  std::vector<Trial> all;
  for (const auto& fixture : fixtures)
    for (const auto& backend : fixture.backends()) all.push_back({0, backend, fixture.name});
  const auto prepared = prepare_all(all, folder);

  std::vector<std::string> by(planted.size());
  std::vector<char> by_default(planted.size());
  const auto round = [&](const std::string& fixture, const std::vector<std::string>& defaults) {
    std::vector<Trial> trials;
    std::vector<std::size_t> which;
    for (std::size_t k = 0; k < planted.size(); ++k) {
      if (!by[k].empty()) continue;
      const auto try_on = [&](const std::string& backend) {
        trials.push_back({number(planted[k]), backend, fixture});
        which.push_back(k);
      };
      for (const auto& backend : defaults) try_on(backend);
      if (defaults.empty() && planted[k].contains("backend")) try_on(text(planted[k], "backend"));
    }
    const auto outcomes = run_all(trials, executor, jobs, prepared);
    for (std::size_t t = 0; t < trials.size(); ++t) {
      const std::size_t k = which[t];
      if (!outcomes[t].caught || !by[k].empty()) continue;
      by_default[k] = !defaults.empty();
      by[k] = fmt::format("{}, {}: {}", trials[t].backend, fixture,
                          outcomes[t].ended.empty() ? joined(outcomes[t].failed, "") : outcomes[t].ended);
    }
  };
  for (const auto& fixture : fixtures) round(fixture.name, fixture.backends());
  for (const auto& fixture : fixtures) round(fixture.name, {});

  std::size_t caught = 0, defaults = 0, equivalent = 0, wrong = 0;
  std::string table;
  for (std::size_t k = 0; k < planted.size(); ++k) {
    const std::string reason = why_equivalent(planted[k]);
    std::string verdict = by[k].empty() ? "NOT CAUGHT" : by[k];
    if (!reason.empty()) {
      ++equivalent;
      wrong += !by[k].empty();
      verdict = by[k].empty() ? "equivalent: " + reason : "CAUGHT, yet called equivalent: " + by[k];
    } else {
      caught += !by[k].empty();
      defaults += static_cast<std::size_t>(by_default[k]);
      wrong += by[k].empty();
    }
    table += fmt::format("{:<38} {}\n{:<38} {}\n", text(planted[k], "name"), text(planted[k], "what"), "", verdict);
  }
  const std::string alarms = failures_without_fault(all, executor, jobs, prepared);
  all_caught = wrong == 0 && alarms.empty();
  return table + alarms +
         fmt::format(
             "{} of {} caught by conform, {} of them at the backends' defaults; {} equivalent with a "
             "reason; {} not_run here; without a fault {}\n",
             caught, planted.size() - equivalent, defaults, equivalent, not_run,
             alarms.empty() ? "all pass" : "SOME FAIL");
}

}  // namespace decant
