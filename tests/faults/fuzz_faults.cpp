/// \file
/// A campaign a fault: how many problems it takes, and what is left of the one that shows it.
#include "tests/faults/fuzz_faults.hpp"

#include "tools/fuzz/campaign.hpp"

#include <fmt/format.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

namespace decant {
namespace {

struct Child {
  pid_t pid;
  int from;
  std::size_t fault;
};

/// In the child: "cases particles-found particles-shrunk tries property".
std::string campaign_text(const std::string& backend, Executor executor, std::int64_t most_cases,
                          std::uint64_t first_seed) {
  fuzz::Settings settings;
  settings.backends = {backend};
  for (const fuzz::Property& p : fuzz::properties())
    if (p.of_backend) settings.properties.insert(p.name);
  settings.first_seed = first_seed;
  settings.cases = most_cases;
  settings.most_findings = 1;
  const fuzz::Campaign c = fuzz::run_campaign(settings, [&](const std::string& choice) {
    const auto colon = choice.find(':');
    return make_backend(choice.substr(0, colon), executor,
                        colon == std::string::npos ? "" : choice.substr(colon + 1));
  });
  if (c.findings.empty()) return fmt::format("{} 0 0 0 -", c.cases);
  const fuzz::Finding& f = c.findings.front();
  return fmt::format("{} {} {} {} {}", c.cases, f.found_particles, f.genome.points.size(), f.tries,
                     f.outcome.property);
}

Child begin(std::size_t k, const nlohmann::json& fault, Executor executor,
            std::int64_t most_cases, std::uint64_t first_seed) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t pid = fork();
  if (pid < 0) throw std::runtime_error("no process");
  if (pid > 0) {
    close(ends[1]);
    return {pid, ends[0], k};
  }
  close(ends[0]);
  alarm(300);
  choose_fault(executor, fault["number"]);
  std::string text = "failed";
  try {
    text = campaign_text(fault["backend"], executor, most_cases, first_seed);
  } catch (const std::exception& error) {
    text = std::string("failed: ") + error.what();
  }
  const bool whole = write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size());
  _exit(whole ? 0 : 4);
}

std::string end(const Child& child) {
  std::string text;
  char buffer[512];
  for (ssize_t n; (n = read(child.from, buffer, sizeof buffer)) > 0;)
    text.append(buffer, static_cast<std::size_t>(n));
  close(child.from);
  int status = 0;
  waitpid(child.pid, &status, 0);
  if (WIFSIGNALED(status)) return WTERMSIG(status) == SIGALRM ? "hang" : "crash";
  return text;
}

}  // namespace

std::string fuzz_faults(const nlohmann::json& faults, Executor executor, int jobs,
                        std::int64_t most_cases, std::uint64_t first_seed, bool& all_found) {
  std::vector<nlohmann::json> planted;
  for (const auto& f : faults)
    if (f["on"] != "cuda" || executor == Executor::cuda) planted.push_back(f);
  std::vector<std::string> found(planted.size());
  std::vector<Child> running;
  for (std::size_t next = 0, done = 0; done < planted.size(); ++done) {
    for (; next < planted.size() && running.size() < static_cast<std::size_t>(jobs); ++next)
      running.push_back(begin(next, planted[next], executor, most_cases, first_seed));
    found[running.front().fault] = end(running.front());
    running.erase(running.begin());
  }
  std::string table = fmt::format("{:<26} {:<22} {:>8} {:>10} {:>8} {:>6}  {}\n", "fault", "backend",
                                  "problems", "particles", "shrunk", "tries",
                                  "property; what is wrong");
  std::size_t count = 0;
  std::vector<long> cases;
  for (std::size_t k = 0; k < planted.size(); ++k) {
    char property[64] = "-";
    long tried = 0, particles = 0, shrunk = 0, tries = 0;
    const bool told = std::sscanf(found[k].c_str(), "%ld %ld %ld %ld %63s", &tried, &particles,
                                  &shrunk, &tries, property) == 5;
    const bool hit = told ? property[0] != '-' : found[k] == "crash" || found[k] == "hang";
    count += hit;
    if (hit && told) cases.push_back(tried);
    table += fmt::format("{:<26} {:<22} {:>8} {:>10} {:>8} {:>6}  {}; {}\n",
                         planted[k]["name"].get<std::string>(),
                         planted[k]["backend"].get<std::string>(), told ? tried : 0,
                         told && hit ? std::to_string(particles) : "-",
                         told && hit ? std::to_string(shrunk) : "-", tries,
                         !hit ? "NOT FOUND" : told ? property : found[k],
                         planted[k]["what"].get<std::string>());
  }
  std::sort(cases.begin(), cases.end());
  table += fmt::format("{} of {} found within {} problems of seeds from {}", count, planted.size(),
                       most_cases, first_seed);
  if (!cases.empty())
    table += fmt::format("; median {}, most {}", cases[cases.size() / 2], cases.back());
  all_found = count == planted.size();
  return table + "\n";
}

}  // namespace decant
