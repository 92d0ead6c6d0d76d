/// \file
/// Threads take seeds by turns, each with backends of its own; what they find is put in order after.
#include "tools/fuzz/campaign.hpp"

#include "oracle/files/file_aside.hpp"
#include "oracle/files/fixture_file.hpp"
#include "reference/scene_file.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/file_name.hpp"
#include "tools/common/recording.hpp"

#include <fmt/format.h>
#include <omp.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

namespace decant::fuzz {
namespace {

using Clock = std::chrono::steady_clock;

std::size_t bin_of(double score) {
  if (!(score > 0)) return 0;
  // A score that is no number is beyond every bound.
  const double at = std::isnan(score) ? 1 : std::ceil(std::log2(score));
  return static_cast<std::size_t>(std::clamp(at + 10, 0.0, 11.0));
}

class Running {
 public:
  Running(const Settings& settings, const BackendMaker& make) : s_(settings), make_(make) {
    all_.first_seed = s_.first_seed;
  }

  Campaign run() {
    // A case is too small to be shared, and who waits for a share of it keeps a core from the next one.
    std::optional<tbb::global_control> alone;
    if (s_.one_core_each) alone.emplace(tbb::global_control::max_allowed_parallelism, 1);
    std::vector<std::thread> threads;
    for (int t = 0; t < s_.threads; ++t) threads.emplace_back([this] { work(); });
    for (auto& thread : threads) thread.join();
    if (failure_) std::rethrow_exception(failure_);
    for (auto& [key, counted] : statistics_) all_.statistics.push_back(counted);
    std::sort(all_.counterexamples.begin(), all_.counterexamples.end(),
              [](const Counterexample& a, const Counterexample& b) {
                return std::tie(a.seed, a.outcome.backend, a.outcome.property) <
                       std::tie(b.seed, b.outcome.backend, b.outcome.property);
              });
    all_.seconds = seconds();
    return all_;
  }

 private:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  bool over(std::int64_t next) const {
    return ended_ || (s_.cases >= 0 && next >= s_.cases) || (s_.seconds > 0 && seconds() >= s_.seconds) ||
           (s_.stop && s_.stop());
  }

  /// The next case, which whoever gets it does. Whether there is one is asked while none is given out: seeds before
  /// the last one must not be left behind.
  std::optional<std::int64_t> next_case() {
    const std::lock_guard lock(next_mutex_);
    if (over(next_)) ended_ = true;
    return ended_ ? std::nullopt : std::optional(next_++);
  }

  void work() {
    try {
      if (s_.one_core_each) omp_set_num_threads(1);
      Tester tester(s_.backends, s_.properties, make_, s_.every_case);
      while (const std::optional<std::int64_t> k = next_case()) {
        const std::uint64_t seed = s_.first_seed + static_cast<std::uint64_t>(*k);
        const Case fuzz_case = random_case(seed);
        const Fixture fixture = fixture_of(fuzz_case, fmt::format("fuzz-{}", seed));
        const std::vector<Outcome> outcomes = tester.test(fixture, seed);
        take(tags_of(fixture), outcomes, seed);
        for (const Outcome& outcome : outcomes)
          if (!outcome.holds) find(tester, seed, fuzz_case, outcome);
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      ended_ = true;
    }
  }

  void take(const Tags& tags, const std::vector<Outcome>& outcomes, std::uint64_t seed) {
    const std::lock_guard lock(mutex_);
    ++all_.cases;
    for (std::size_t c = 0; c < tags.size(); ++c) all_.tags[c] += tags[c];
    if (outcomes.empty()) ++all_.undecidable;
    for (const Outcome& o : outcomes) {
      PropertyStatistics& counted = statistics_[{o.property, o.backend}];
      counted.backend = o.backend;
      counted.property = o.property;
      ++counted.asked;
      counted.failed += !o.holds;
      if (o.stepwise) {
        const auto here = static_cast<std::int64_t>(seed);
        if (counted.stepwise++ == 0 || here < counted.stepwise_seed) counted.stepwise_seed = here;
        continue;
      }
      ++counted.histogram[bin_of(o.holds ? o.score : 2)];
      if (o.score < counted.worst || (o.score == counted.worst && seed >= counted.worst_seed)) continue;
      counted.worst = o.score;
      counted.worst_seed = seed;
      counted.worst_field = o.field;
    }
    if (!s_.progress || std::chrono::duration<double>(Clock::now() - told_).count() < 1) return;
    told_ = Clock::now();
    all_.seconds = seconds();
    Campaign now = all_;
    for (auto& [key, counted] : statistics_) now.statistics.push_back(counted);
    s_.progress(now);
  }

  /// One counterexample a property and backend is minimised; the others are counted.
  void find(Tester& tester, std::uint64_t seed, const Case& fuzz_case, const Outcome& outcome) {
    {
      const std::lock_guard lock(mutex_);
      if (!minimised_.insert(outcome.backend + " " + outcome.property).second) return;
    }
    Counterexample found;
    found.seed = seed;
    found.fuzz_case = fuzz_case;
    found.outcome = outcome;
    found = minimise(tester, std::move(found), s_.minimise_tries, s_.minimise_seconds, s_.stop);
    const std::lock_guard lock(mutex_);
    if (!s_.failures.empty()) found.file = write_counterexample(s_.failures, found);
    all_.counterexamples.push_back(std::move(found));
    if (static_cast<int>(all_.counterexamples.size()) >= s_.most_counterexamples) ended_ = true;
  }

  const Settings& s_;
  const BackendMaker& make_;
  Clock::time_point start_ = Clock::now(), told_ = start_;
  std::int64_t next_ = 0;  // case
  std::atomic<bool> ended_{false};
  std::mutex mutex_, next_mutex_;
  std::map<std::pair<std::string, std::string>, PropertyStatistics> statistics_;  // by property and backend
  std::set<std::string> minimised_;
  Campaign all_;
  std::exception_ptr failure_;
};

}  // namespace

Campaign run_campaign(const Settings& settings, const BackendMaker& make) { return Running(settings, make).run(); }

std::string write_case(const std::filesystem::path& folder, const Case& fuzz_case, const std::string& name,
                       const std::map<std::string, std::string>& provenance) {
  std::filesystem::create_directories(folder);
  Fixture fixture = fixture_of(fuzz_case, name);
  fixture.provenance = build_provenance();
  for (const auto& [key, text] : provenance) fixture.provenance[key] = text;
  (void)record_answer(fixture, run_substeps, run_members);
  const auto file = folder / (name + ".h5");
  write_fixture(file, fixture);
  write_text_file(folder / (name + ".json"), scene_to_json(fixture.scene));
  return file.string();
}

std::string write_counterexample(const std::filesystem::path& folder, const Counterexample& counterexample) {
  std::string backend = counterexample.outcome.backend;
  // Of a plug-in the library, not where it lies.
  if (const auto slash = backend.rfind('/'); slash != std::string::npos) backend.replace(0, slash + 1, "plugin-");
  return write_case(
      folder, counterexample.fuzz_case,
      fmt::format("fuzz-{}-{}-{}", counterexample.seed, plain_file_name(backend), counterexample.outcome.property),
      {{"fuzz_seed", fmt::format("{}", counterexample.seed)},
       {"fuzz_property", counterexample.outcome.property},
       {"fuzz_backend", counterexample.outcome.backend},
       {"fuzz_reason", counterexample.outcome.reason}});
}

}  // namespace decant::fuzz
