/// \file
/// A campaign a fault: how many cases it takes, and what is left of the one that shows it.
#include "tests/faults/fuzz_faults.hpp"

#include "tests/faults/trials.hpp"
#include "tools/fuzz/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace decant {
namespace {

/// In the child: "cases particles-found particles-minimised tries property".
std::string campaign_text(const std::vector<std::string>& backends, Executor executor, std::int64_t most_cases,
                          std::uint64_t first_seed) {
  fuzz::Settings settings;
  settings.backends = backends;
  for (const fuzz::Property& p : fuzz::properties())
    if (p.of_backend) settings.properties.insert(p.name);
  settings.first_seed = first_seed;
  settings.cases = most_cases;
  settings.most_counterexamples = 1;
  const fuzz::Campaign c =
      fuzz::run_campaign(settings, [&](const std::string& choice) { return backend_of(choice, executor); });
  if (c.counterexamples.empty()) return fmt::format("{} 0 0 0 -", c.cases);
  const fuzz::Counterexample& f = c.counterexamples.front();
  return fmt::format("{} {} {} {} {}", c.cases, f.found_particles, f.fuzz_case.points.size(), f.tries,
                     f.outcome.property);
}

/// The backend that a fault is planted for; all of them, and the options that it needs, where nobody knew.
std::vector<std::string> backends_of(const nlohmann::json& fault) {
  if (fault.contains("check")) return {fault.at("backend").get<std::string>()};
  std::vector<std::string> backends = {"brute", "hash", "list"};
  if (fault.contains("backend")) backends.push_back(fault.at("backend").get<std::string>());
  return backends;
}

}  // namespace

std::string fuzz_faults(const nlohmann::json& faults, Executor executor, int jobs, std::int64_t most_cases,
                        std::uint64_t first_seed, bool& all_found) {
  std::vector<nlohmann::json> planted;
  for (const auto& f : faults)
    if ((f["on"] != "cuda" || executor == Executor::cuda) && f.value("equivalent", std::string()).empty())
      planted.push_back(f);
  // A fault by which the campaign itself cannot run is not found: what throws is no crash.
  const std::vector<Said> found = in_processes(planted.size(), jobs, 300, [&](std::size_t k) {
    choose_fault(executor, planted[k]["number"].get<int>());
    return campaign_text(backends_of(planted[k]), executor, most_cases, first_seed);
  });
  std::string table = fmt::format("{:<26} {:<22} {:>8} {:>10} {:>8} {:>6}  {}\n", "fault", "backend", "cases",
                                  "particles", "minimised", "tries", "property; what is wrong");
  std::size_t count = 0;
  std::vector<long> cases;
  for (std::size_t k = 0; k < planted.size(); ++k) {
    char property[64] = "-";
    long tried = 0, particles = 0, minimised = 0, tries = 0;
    const bool told = std::sscanf(found[k].text.c_str(), "%ld %ld %ld %ld %63s", &tried, &particles, &minimised, &tries,
                                  property) == 5;
    const bool hit = told ? property[0] != '-' : found[k].ended == "crash" || found[k].ended == "hang";
    count += hit;
    if (hit && told) cases.push_back(tried);
    table +=
        fmt::format("{:<26} {:<22} {:>8} {:>10} {:>8} {:>6}  {}; {}\n", planted[k]["name"].get<std::string>(),
                    planted[k].value("backend", "all"), told ? tried : 0, told && hit ? std::to_string(particles) : "-",
                    told && hit ? std::to_string(minimised) : "-", tries,
                    !hit   ? "NOT FOUND"
                    : told ? property
                           : found[k].ended,
                    planted[k]["what"].get<std::string>());
  }
  std::sort(cases.begin(), cases.end());
  table +=
      fmt::format("{} of {} found within {} cases of seeds from {}", count, planted.size(), most_cases, first_seed);
  if (!cases.empty()) table += fmt::format("; median {}, most {}", cases[cases.size() / 2], cases.back());
  all_found = count == planted.size();
  return table + "\n";
}

}  // namespace decant
