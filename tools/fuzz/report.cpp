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
      "{} problems of seeds {} to {} in {:.1f} s, {:.0f} per second; {} with pairs so near H that fp32\n"
      "cannot tell who is a neighbor\n\nshare of problems with",
      c.cases, c.first_seed, c.first_seed + static_cast<std::uint64_t>(c.cases) - 1, c.seconds,
      static_cast<double>(c.cases) / c.seconds, c.undecidable);
  for (std::size_t k = 0; k < class_names.size(); ++k)
    text += fmt::format(
        "{}{} {:.1f} %", k ? ", " : " ", class_names[k],
        100.0 * static_cast<double>(c.classes[k]) / static_cast<double>(std::max<std::int64_t>(c.cases, 1)));
  text += fmt::format("\n\n{:<14} {:<24} {:>9} {:>7} {:>8} {:>10}  {}\n", "property", "backend", "asked", "failed",
                      "worst", "seed", "of");
  for (const Tally& t : c.tallies)
    text += fmt::format("{:<14} {:<24} {:>9} {:>7} {:>8.3f} {:>10}  {}\n", t.property, t.backend, t.asked, t.failed,
                        t.worst, t.worst_seed, t.worst_field);
  for (const Finding& f : c.findings)
    text += fmt::format(
        "\nseed {}: {} does not hold for {}\n  {}\n  minimised in {} tries from {} particles to {}\n{}", f.seed,
        f.outcome.property, f.outcome.backend, f.outcome.reason, f.tries, f.found_particles, describe(f.genome),
        f.file.empty() ? "" : fmt::format("  decant conform {} --backend {}\n", f.file, f.outcome.backend));
  return text;
}

void write_campaign(const std::filesystem::path& file, const Campaign& c, const BackendInfo& backend) {
  Hdf5Writer out(file);
  out.attribute("/", "decant_fuzz", 1);
  out.attribute("/", "executor", backend.executor);
  out.attribute("/", "device", backend.device);
  out.attribute("/", "first_seed", static_cast<std::int64_t>(c.first_seed));
  out.attribute("/", "cases", c.cases);
  out.attribute("/", "undecidable", c.undecidable);
  out.attribute("/", "seconds", c.seconds);
  for (const auto& [key, value] : build_provenance()) out.attribute("/provenance", key, value);
  out.strings("/classes/name", {class_names.begin(), class_names.end()});
  out.integers("/classes/cases", whole(c.classes, [](std::int64_t n) { return n; }), "problems that have it");
  using T = Tally;
  out.strings("/tallies/property", texts(c.tallies, [](const T& t) { return t.property; }));
  out.strings("/tallies/backend", texts(c.tallies, [](const T& t) { return t.backend; }));
  out.integers("/tallies/asked", whole(c.tallies, [](const T& t) { return t.asked; }));
  out.integers("/tallies/failed", whole(c.tallies, [](const T& t) { return t.failed; }));
  Eigen::VectorXd worst(static_cast<Eigen::Index>(c.tallies.size()));
  for (std::size_t k = 0; k < c.tallies.size(); ++k) worst[static_cast<Eigen::Index>(k)] = c.tallies[k].worst;
  out.vector("/tallies/worst", worst, "1", "largest |error| / tolerance");
  out.integers("/tallies/worst_seed", whole(c.tallies, [](const T& t) { return t.worst_seed; }));
  out.strings("/tallies/worst_field", texts(c.tallies, [](const T& t) { return t.worst_field; }));
  for (std::size_t bin = 0; bin < Tally{}.histogram.size(); ++bin)
    out.integers(fmt::format("/tallies/score_bin_{:02}", bin),
                 whole(c.tallies, [bin](const T& t) { return t.histogram[bin]; }),
                 bin == 0    ? "scores up to 2^-10"
                 : bin == 11 ? "scores above 1, and failures"
                             : "scores up to 2^(bin - 10)");
  using F = Finding;
  out.integers("/findings/seed", whole(c.findings, [](const F& f) { return f.seed; }));
  out.strings("/findings/backend", texts(c.findings, [](const F& f) { return f.outcome.backend; }));
  out.strings("/findings/property", texts(c.findings, [](const F& f) { return f.outcome.property; }));
  out.strings("/findings/reason", texts(c.findings, [](const F& f) { return f.outcome.reason; }));
  out.strings("/findings/problem", texts(c.findings, [](const F& f) { return describe(f.genome); }));
  out.strings("/findings/file", texts(c.findings, [](const F& f) { return f.file; }));
  out.integers("/findings/found_particles", whole(c.findings, [](const F& f) { return f.found_particles; }));
  out.integers("/findings/shrunk_particles", whole(c.findings, [](const F& f) { return f.genome.points.size(); }));
  out.integers("/findings/tries", whole(c.findings, [](const F& f) { return f.tries; }));
  out.commit();
}

}  // namespace decant::fuzz
