/// \file
/// References prepared ahead, backends judged, rows kept.
#include "tools/commands/conform_run.hpp"

#include "oracle/checks/measured_reference.hpp"
#include "oracle/checks/neighborhood.hpp"
#include "oracle/report/report.hpp"
#include "reference/error.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/common/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>

namespace decant {
namespace {

// Of what a report shows around its first failing particle, in H.
constexpr double shown_radius = 6;

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

}  // namespace

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

void check_all(std::vector<Candidate>& candidates, const ConformRun& run, Interruptible& work, Judged& judged) {
  using Clock = std::chrono::steady_clock;
  const auto total = static_cast<std::int64_t>(candidates.size() * run.fixtures.size());
  const bool any =
      std::any_of(candidates.begin(), candidates.end(), [](const Candidate& c) { return c.backend != nullptr; });
  Progress progress("check", total, 0, run.quiet);
  // The oracle is sequential: it works on the next fixture while backends are judged on this one.
  const auto prepared = [&](std::size_t k) {
    return std::async(std::launch::async,
                      [&, k] { return prepared_for(run.fixtures[k], run.checks, run.sample_every, run.own); });
  };
  std::future<Prepared> next;
  if (any && !run.fixtures.empty()) next = prepared(0);
  for (std::size_t k = 0; k < run.fixtures.size(); ++k) {
    const Fixture& fixture = run.fixtures[k];
    Prepared reference;
    if (any) work.part([&] { reference = next.get(); });
    const auto& oracle = reference.oracle;
    if (any && k + 1 < run.fixtures.size()) next = prepared(k + 1);
    for (Candidate& candidate : candidates) {
      progress.update(judged.pairs, fixture.name + " " + candidate.info.name);
      if (!candidate.backend || !oracle) {
        judged.report.rows.push_back(
            row_that_did_not_run(candidate, fixture, candidate.backend ? reference.why_not : candidate.why_not));
        ++judged.pairs;
        continue;
      }
      std::vector<CheckRow> rows;
      const auto start = Clock::now();
      work.part([&] {
        rows = run_checks(*candidate.backend, fixture, *oracle, run.checks);
        for (CheckRow& row : rows) condense(row);
      });
      judged.seconds.emplace_back(std::chrono::duration<double>(Clock::now() - start).count(),
                                  candidate.info.name + " " + fixture.name);
      bool fails = false;
      for (CheckRow& row : rows) {
        fails |= verdict_of(row) == Verdict::fail;
        if (!judged.report.neighborhood && is_located(row))
          judged.report.neighborhood = neighborhood_of(fixture, oracle->walls, oracle->own.fields.density, row,
                                                       static_cast<std::int64_t>(judged.report.rows.size()),
                                                       shown_radius * fixture.scene.support_radius());
        judged.report.rows.push_back(std::move(row));
      }
      ++judged.pairs;
      if (fails && run.exit_first) return;
    }
  }
  progress.update(total);
}

void add_what_was_not_judged(const std::vector<Candidate>& candidates, const std::vector<Fixture>& fixtures,
                             const std::string& why, Judged& judged) {
  std::int64_t pair = 0;
  for (const Fixture& fixture : fixtures)
    for (const Candidate& candidate : candidates)
      if (pair++ >= judged.pairs) judged.report.rows.push_back(row_that_did_not_run(candidate, fixture, why));
}

std::string slowest(std::vector<std::pair<double, std::string>> seconds, int most) {
  std::sort(seconds.rbegin(), seconds.rend());
  std::string text;
  for (std::size_t k = 0; k < seconds.size() && k < static_cast<std::size_t>(most); ++k)
    text += fmt::format("{:8.2f} s  {}\n", seconds[k].first, seconds[k].second);
  return text.empty() ? text : "\nslowest, without the reference\n" + text;
}

}  // namespace decant
