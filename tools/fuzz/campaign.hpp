/// \file
/// A fuzzing campaign: cases from consecutive seeds, held to properties; what fails is minimised, written
/// as a fixture that shows it again, and reported.
#pragma once

#include "oracle/backend.hpp"
#include "tools/fuzz/case.hpp"

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace decant::fuzz {

/// How long a case's runs are, and how many perturbed ones say how far correct runs are apart.
inline constexpr int run_substeps = 8, run_members = 8;

/// A property that every case has to have.
struct Property {
  const char* name;
  const char* sentence;
  int every;        // of so many cases one is held to it, by its seed
  bool of_backend;  // else of the scene alone
};
const std::vector<Property>& properties();

/// What one property showed on one case.
struct Outcome {
  std::string backend, property;
  bool holds = true;
  double score = 0;       // largest |error| / tolerance; 0 where the property is yes or no
  std::string field;      // and what it is of
  std::string reason;     // in words, where it does not hold
  bool stepwise = false;  // outside its bound, and holds all the same: each substep is right from the state before
};

/// Makes the backend of a choice on the command line.
using BackendMaker = std::function<std::unique_ptr<Backend>(const std::string& choice)>;

/// Backends that serve one thread.
class Tester {
 public:
  /// \param every_case  asks each property of every case, whosever turn it is
  Tester(std::vector<std::string> backends, std::set<std::string> properties, BackendMaker make,
         bool every_case = false);

  /// Holds one case to all properties whose turn it is. Empty `outcomes`: fp32 cannot tell this
  /// case's neighbors apart, and no property is asked.
  std::vector<Outcome> test(const Fixture& drawn, std::uint64_t seed);
  /// One property of one backend, whosever turn it is.
  Outcome test_one(const Case& fuzz_case, std::uint64_t seed, const Outcome& like);

 private:
  std::vector<Outcome> outcomes(const Fixture& drawn, std::uint64_t seed, const std::set<std::string>& backends,
                                const std::set<std::string>& wanted);
  Backend& backend(const std::string& choice);

  std::vector<std::string> names_;
  std::set<std::string> properties_;
  BackendMaker make_;
  bool every_case_;
  std::vector<std::pair<std::string, std::unique_ptr<Backend>>> made_;
};

/// A failure and what minimising left of it.
struct Counterexample {
  std::uint64_t seed = 0;
  Outcome outcome;  // of the minimised case
  Case fuzz_case;   // minimised
  std::size_t found_particles = 0;
  int tries = 0;     // cases tried while minimising
  std::string file;  // the fixture written; empty: none
};

/// Fewer particles, then smaller numbers, as long as the same property of the same backend fails.
/// Ends after so many tries or seconds, or as soon as stop() says so, with what is smallest by then.
Counterexample minimise(Tester& tester, Counterexample found, int most_tries, double seconds,
                        const std::function<bool()>& stop = {});

/// Scores of a property of a backend over all cases.
struct PropertyStatistics {
  std::string backend, property;
  std::int64_t asked = 0, failed = 0, stepwise = 0;  // the last ones hold
  std::int64_t stepwise_seed = -1;                   // the smallest; none: -1
  double worst = 0;                                  // of all but these
  std::uint64_t worst_seed = 0;
  std::string worst_field;
  std::array<std::int64_t, 12> histogram{};  // of them too, by log2(score) from ≤ −10 to 0, and failures
};

struct Settings {
  std::vector<std::string> backends;
  std::set<std::string> properties;
  bool every_case = false;  // properties are asked of every case, whosever turn it is
  std::uint64_t first_seed = 1;
  std::int64_t cases = 1000;  // of consecutive seeds; < 0: as many as there is time for
  double seconds = 0;         // 0: no limit
  int threads = 1;
  int most_counterexamples = 16;  // a campaign stops here
  int minimise_tries = 2000;
  double minimise_seconds = 20;    // of each counterexample
  std::filesystem::path failures;  // folder for fixtures of counterexamples; empty: none are written
  std::function<bool()> stop;
  std::function<void(const struct Campaign&)> progress;  // now and then, from one thread at a time
  bool one_core_each = true;                             // OpenMP inside a backend is switched off
};

struct Campaign {
  std::uint64_t first_seed = 0;
  std::int64_t cases = 0;        // cases drawn, consecutive
  std::int64_t undecidable = 0;  // of them, not held to anything
  double seconds = 0;
  std::array<std::int64_t, tag_names.size()> tags{};
  std::vector<PropertyStatistics> statistics;
  std::vector<Counterexample> counterexamples;
};

/// Runs. The same seeds give the same statistics, whatever the number of threads.
Campaign run_campaign(const Settings& settings, const BackendMaker& make);

/// Writes a case with the oracle's answer, for `decant conform`, and its scene beside it; returns the
/// fixture's file.
std::string write_case(const std::filesystem::path& folder, const Case& fuzz_case, const std::string& name,
                       const std::map<std::string, std::string>& provenance);
std::string write_counterexample(const std::filesystem::path& folder, const Counterexample& counterexample);

/// Table for people.
std::string campaign_table(const Campaign& campaign);

/// Layout in oracle/formats/fuzz.md.
void write_campaign(const std::filesystem::path& file, const Campaign& campaign, const BackendInfo& backend);

}  // namespace decant::fuzz
