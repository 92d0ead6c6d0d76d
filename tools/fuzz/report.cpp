/// \file
/// Campaigns as a table and as HDF5.
#include "oracle/files/hdf5_io.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/fuzz/campaign.hpp"

#include <fmt/format.h>

namespace decant::fuzz {
namespace {

template <class Rows, class Get>
IdVector whole(const Rows& rows, Get get) {
  IdVector values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k)
    values[static_cast<Eigen::Index>(k)] = static_cast<std::int64_t>(get(rows[k]));
  return values;
}
template <class Rows, class Get>
std::vector<std::string> texts(const Rows& rows, Get get) {
  std::vector<std::string> values;
  for (const auto& row : rows) {
    const std::string text = get(row);
    values.push_back(text.empty() ? "-" : text);
  }
  return values;
}

}  // namespace

std::string campaign_table(const Campaign& c) {
  std::string text = fmt::format(
      "{} cases of seeds {} to {} in {:.1f} s, {:.0f} per second; {} with pairs so near H that fp32\n"
      "cannot tell who is a neighbor\n\nshare of cases with",
      c.cases, c.first_seed, c.first_seed + static_cast<std::uint64_t>(c.cases) - 1, c.seconds,
      static_cast<double>(c.cases) / c.seconds, c.undecidable);
  for (std::size_t k = 0; k < tag_names.size(); ++k)
    text +=
        fmt::format("{}{} {:.1f} %", k ? ", " : " ", tag_names[k],
                    100.0 * static_cast<double>(c.tags[k]) / static_cast<double>(std::max<std::int64_t>(c.cases, 1)));
  text += fmt::format("\n\n{:<14} {:<24} {:>9} {:>7} {:>8} {:>8} {:>10}  {}\n", "property", "backend", "asked",
                      "failed", "stepwise", "worst", "seed", "of");
  std::string stepwise;
  for (const PropertyStatistics& t : c.statistics) {
    text += fmt::format("{:<14} {:<24} {:>9} {:>7} {:>8} {:>8.3f} {:>10}  {}\n", t.property, t.backend, t.asked,
                        t.failed, t.stepwise, t.worst, t.worst_seed, t.worst_field);
    if (t.stepwise > 0)
      stepwise += fmt::format("{}{} {} {}", stepwise.empty() ? "" : ", ", t.property, t.backend, t.stepwise_seed);
  }
  if (!stepwise.empty())
    text +=
        "\nstepwise: of those asked, runs that end outside their bound and hold all the same, since each substep is\n"
        "right from the state before; not in worst. First seeds: " +
        stepwise + "\n";
  for (const Counterexample& f : c.counterexamples)
    text += fmt::format(
        "\nseed {}: {} does not hold for {}\n  {}\n  minimised in {} tries from {} particles to {}\n{}", f.seed,
        f.outcome.property, f.outcome.backend, f.outcome.reason, f.tries, f.found_particles, describe(f.fuzz_case),
        f.file.empty() ? "" : fmt::format("  decant conform {} --backend {}\n", f.file, f.outcome.backend));
  return text;
}

void write_campaign(const std::filesystem::path& file, const Campaign& c, const BackendInfo& backend) {
  Hdf5Writer out(file);
  out.attribute("/", "decant_fuzz", 3);
  out.attribute("/", "executor", backend.executor);
  out.attribute("/", "device", backend.device);
  out.attribute("/", "first_seed", static_cast<std::int64_t>(c.first_seed));
  out.attribute("/", "cases", c.cases);
  out.attribute("/", "undecidable", c.undecidable);
  out.attribute("/", "seconds", c.seconds);
  for (const auto& [key, value] : build_provenance()) out.attribute("/provenance", key, value);
  out.strings("/tags/name", {tag_names.begin(), tag_names.end()});
  out.integers("/tags/cases", whole(c.tags, [](std::int64_t n) { return n; }), "cases that have it");
  using T = PropertyStatistics;
  out.strings("/statistics/property", texts(c.statistics, [](const T& t) { return t.property; }));
  out.strings("/statistics/backend", texts(c.statistics, [](const T& t) { return t.backend; }));
  out.integers("/statistics/asked", whole(c.statistics, [](const T& t) { return t.asked; }));
  out.integers("/statistics/failed", whole(c.statistics, [](const T& t) { return t.failed; }));
  out.integers("/statistics/stepwise", whole(c.statistics, [](const T& t) { return t.stepwise; }),
               "cases outside their bound that hold: each substep is right from the state before");
  out.integers("/statistics/stepwise_seed", whole(c.statistics, [](const T& t) { return t.stepwise_seed; }),
               "the smallest; none: -1");
  Eigen::VectorXd worst(static_cast<Eigen::Index>(c.statistics.size()));
  for (std::size_t k = 0; k < c.statistics.size(); ++k) worst[static_cast<Eigen::Index>(k)] = c.statistics[k].worst;
  out.vector("/statistics/worst", worst, "1", "largest |error| / tolerance of all but those stepwise right");
  out.integers("/statistics/worst_seed", whole(c.statistics, [](const T& t) { return t.worst_seed; }));
  out.strings("/statistics/worst_field", texts(c.statistics, [](const T& t) { return t.worst_field; }));
  for (std::size_t bin = 0; bin < PropertyStatistics{}.histogram.size(); ++bin)
    out.integers(fmt::format("/statistics/score_bin_{:02}", bin),
                 whole(c.statistics, [bin](const T& t) { return t.histogram[bin]; }),
                 bin == 0    ? "scores up to 2^-10"
                 : bin == 11 ? "failures"
                             : "scores up to 2^(bin - 10)");
  using F = Counterexample;
  out.integers("/counterexamples/seed", whole(c.counterexamples, [](const F& f) { return f.seed; }));
  out.strings("/counterexamples/backend", texts(c.counterexamples, [](const F& f) { return f.outcome.backend; }));
  out.strings("/counterexamples/property", texts(c.counterexamples, [](const F& f) { return f.outcome.property; }));
  out.strings("/counterexamples/reason", texts(c.counterexamples, [](const F& f) { return f.outcome.reason; }));
  out.strings("/counterexamples/case", texts(c.counterexamples, [](const F& f) { return describe(f.fuzz_case); }));
  out.strings("/counterexamples/file", texts(c.counterexamples, [](const F& f) { return f.file; }));
  out.integers("/counterexamples/found_particles",
               whole(c.counterexamples, [](const F& f) { return f.found_particles; }));
  out.integers("/counterexamples/minimised_particles",
               whole(c.counterexamples, [](const F& f) { return f.fuzz_case.points.size(); }));
  out.integers("/counterexamples/tries", whole(c.counterexamples, [](const F& f) { return f.tries; }));
  out.commit();
}

}  // namespace decant::fuzz
