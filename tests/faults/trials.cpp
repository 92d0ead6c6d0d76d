/// \file
/// Trials and what comes of them.
#include "tests/faults/trials.hpp"

#include "gpu/fault.hpp"
#include "oracle/files/fixture_file.hpp"

#include <fmt/format.h>

#include <set>
#include <sstream>

namespace decant {
#if DECANT_HAS_CUDA
namespace gpu::cuda {
void choose_fault(int number);
}
#endif

void choose_fault(Executor executor, int number) {
  gpu::fault_on_host = number;
#if DECANT_HAS_CUDA
  if (executor == Executor::cuda) gpu::cuda::choose_fault(number);
#else
  (void)executor;
#endif
}

namespace {

void say(const CheckRow& row, std::ostream& out) {
  if (verdict_of(row) == Verdict::pass) return;
  out << row.check << '\t' << row.field << '\t' << row.score << '\n';
}

/// In the child: judges; the failing rows.
std::string failing_rows(const Trial& trial, Executor executor, const Prepared& p) {
  choose_fault(executor, trial.number);
  const auto backend = backend_of(trial.backend, executor);
  std::ostringstream out;
  for (const CheckRow& row : run_checks(*backend, p.fixture, p.oracle, trial.checks)) say(row, out);
  return out.str();
}

Outcome outcome_of(const Said& said) {
  Outcome o;
  std::istringstream lines(said.text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream columns(line);
    std::string check, field, score;
    std::getline(columns, check, '\t');
    std::getline(columns, field, '\t');
    std::getline(columns, score);
    const double value = std::stod(score);
    const auto known = o.failed.find(check);
    if (known == o.failed.end() || !(value <= known->second)) o.failed[check] = value;
  }
  if (!said.ended.empty()) o.ended = said.ended == "hang" ? "hang" : "crash";
  o.caught = !o.failed.empty() || !o.ended.empty();
  return o;
}

}  // namespace

std::string text(const nlohmann::json& fault, const char* key) { return fault.at(key).get<std::string>(); }
int number(const nlohmann::json& fault) { return fault.at("number").get<int>(); }
std::string why_equivalent(const nlohmann::json& fault) { return fault.value("equivalent", std::string()); }

std::vector<Outcome> run_all(const std::vector<Trial>& trials, Executor executor, int jobs,
                             const std::map<std::string, Prepared>& prepared) {
  std::vector<Outcome> outcomes;
  for (const Said& said : in_processes(trials.size(), jobs, 60, [&](std::size_t k) {
         return failing_rows(trials[k], executor, prepared.at(trials[k].fixture));
       }))
    outcomes.push_back(outcome_of(said));
  return outcomes;
}

std::string failures_without_fault(const std::vector<Trial>& trials, Executor executor, int jobs,
                                   const std::map<std::string, Prepared>& prepared) {
  std::string text;
  const auto outcomes = run_all(trials, executor, jobs, prepared);
  for (std::size_t t = 0; t < trials.size(); ++t)
    if (outcomes[t].caught)
      text += fmt::format("without a fault: {} fails on {} ({})\n", trials[t].backend, trials[t].fixture,
                          outcomes[t].failed.empty() ? outcomes[t].ended : outcomes[t].failed.begin()->first);
  return text;
}

std::vector<Trial> clean(const std::vector<Trial>& trials) {
  std::set<std::pair<std::string, std::string>> pairs;
  for (const Trial& t : trials) pairs.emplace(t.backend, t.fixture);
  std::vector<Trial> all;
  for (const auto& [backend, fixture] : pairs) all.push_back({0, backend, fixture});
  return all;
}

std::map<std::string, Prepared> prepare_all(const std::vector<Trial>& trials, const std::filesystem::path& folder) {
  std::map<std::string, Prepared> prepared;
  for (const Trial& t : trials) {
    if (prepared.count(t.fixture)) continue;
    Fixture fixture = read_fixture(folder / (t.fixture + ".h5"));
    PreparedReference oracle = prepare_reference(fixture);
    prepared.emplace(t.fixture, Prepared{std::move(fixture), std::move(oracle)});
  }
  return prepared;
}

std::string joined(const std::map<std::string, double>& failed, const std::string& but) {
  std::string names;
  for (const auto& [name, score] : failed)
    if (name != but) names += (names.empty() ? "" : ", ") + name;
  return names;
}

}  // namespace decant
