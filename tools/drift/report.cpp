/// \file
/// Drift as a table and as HDF5.
#include "oracle/checks/audit.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/drift/drift.hpp"

#include <fmt/format.h>

#include <cmath>

namespace decant::drift {
namespace {

std::string number(double value, const char* format = "{:.1e}") {
  if (std::isnan(value)) return "-";
  return value == 0 ? "0" : fmt::format(fmt::runtime(format), value);
}

std::string percent(double share) {
  if (std::isnan(share)) return "-";
  return share == 0 ? "0" : share < 1e-4 ? fmt::format("{:.0e}", share) : fmt::format("{:.2f} %", 100 * share);
}

/// Columns of equal length in one group.
template <class Row>
class Columns {
 public:
  Columns(Hdf5Writer& out, std::string group, const std::vector<Row>& rows)
      : out_(out), group_(std::move(group) + "/"), rows_(rows) {}

  template <class Get>
  void real(const char* name, const char* unit, Get get, const char* description = "") {
    Eigen::VectorXd values(size());
    for (Eigen::Index k = 0; k < size(); ++k) values[k] = get(row(k));
    out_.vector(group_ + name, values, unit, description);
  }
  template <class Get>
  void whole(const char* name, Get get, const char* description = "") {
    IdVector values(size());
    for (Eigen::Index k = 0; k < size(); ++k) values[k] = static_cast<std::int64_t>(get(row(k)));
    out_.integers(group_ + name, values, description);
  }
  template <class Get>
  void text(const char* name, Get get) {
    std::vector<std::string> values;
    for (const Row& r : rows_) values.push_back(get(r));
    out_.strings(group_ + name, values);
  }

 private:
  Eigen::Index size() const { return static_cast<Eigen::Index>(rows_.size()); }
  const Row& row(Eigen::Index k) const { return rows_[static_cast<std::size_t>(k)]; }

  Hdf5Writer& out_;
  std::string group_;
  const std::vector<Row>& rows_;
};

template <class Row>
void list_columns(Columns<Row>& c) {
  c.text("fixture", [](const Row& r) { return r.fixture; });
  c.whole(
      "interval", [](const Row& r) { return r.list.interval; },
      "substeps between rebuilds; 0: before a pair can be missed; -1: as its owner does");
  c.real("skin", "1", [](const Row& r) { return r.list.skin; }, "share of H; NaN for intervals below 1");
  c.whole("derived", [](const Row& r) { return r.list.derived; }, "1: the skin that theory asks for");
}

void write_rows(Hdf5Writer& out, const std::vector<Row>& rows) {
  using R = Row;
  Columns<R> c(out, "/rows", rows);
  list_columns(c);
  c.whole(
      "first_miss", [](const R& r) { return r.first_miss; },
      "substeps after a rebuild, the earliest; the interval where nothing is missed");
  c.whole(
      "proved_until", [](const R& r) { return r.proved_until; },
      "substeps after a rebuild for which displacements prove the list complete");
  c.real("missed_share", "1", [](const R& r) { return r.missed_share; }, "of the pairs within H, mean over the window");
  c.real("worst_missed_share", "1", [](const R& r) { return r.worst_missed_share; });
  c.real("wall_missed_share", "1", [](const R& r) { return r.wall_missed_share; }, "of the wall's pairs, mean");
  c.real("deepest", "1", [](const R& r) { return r.deepest; }, "(H - r)/H of a missed pair");
  c.real("wasted_share", "1", [](const R& r) { return r.wasted_share; }, "of the listed pairs, not within H");
  c.real("density_score", "1", [](const R& r) { return r.density_score; }, "largest error over what fp32 is allowed");
  c.real("acceleration_score", "1", [](const R& r) { return r.acceleration_score; });
  c.real(
      "density_rms", "1", [](const R& r) { return r.density_rms; },
      "RMS error over RMS field, largest over the window");
  c.real("pressure_rms", "1", [](const R& r) { return r.pressure_rms; });
  c.real("acceleration_rms", "1", [](const R& r) { return r.acceleration_rms; }, "gravity left out");
  c.real("wall_acceleration_rms", "1", [](const R& r) { return r.wall_acceleration_rms; }, "the wall's terms alone");
  c.real(
      "own_missed_share", "1", [](const R& r) { return r.own_missed_share; },
      "of the backend's own lists in the same window, by its count or by the lists it gives; NaN: not told");
  c.real("own_wall_missed_share", "1", [](const R& r) { return r.own_wall_missed_share; });
  c.real(
      "expected_missed_share", "1", [](const R& r) { return r.expected.missed_share; },
      "by theory, from the first state, at the last substep before a rebuild");
  c.real("expected_density_rms", "1", [](const R& r) { return r.expected.density_rms; });
  c.real("expected_acceleration_rms", "1", [](const R& r) { return r.expected.acceleration_rms; });
  c.real("substep_us", "us", [](const R& r) { return r.substep_us; }, "amortised; NaN: not timed");
  c.real("rebuild_every", "1", [](const R& r) { return r.rebuild_every; }, "substeps a rebuild, as the backend counts");
  c.real("deviation", "1", [](const R& r) { return r.deviation; }, "RMS of positions beside complete lists, over dx");
  c.real(
      "deviation_over_ensemble", "1", [](const R& r) { return r.deviation_over_ensemble; },
      "over that of runs perturbed by rounding");
  c.real("energy_drift", "J", [](const R& r) { return r.energy_drift; }, "beside complete lists");
  c.real("momentum_drift", "kg m/s", [](const R& r) { return r.momentum_drift; }, "beside complete lists");
}

/// A sample and whose it is.
struct Placed {
  std::string fixture;
  double time;
  ListChoice list;
  const Sample* sample;
};

void write_samples(Hdf5Writer& out, const std::string& group, const std::vector<Placed>& samples) {
  using P = Placed;
  Columns<P> c(out, group, samples);
  list_columns(c);
  c.real("time", "s", [](const P& p) { return p.time; }, "of the build; NaN in a window");
  c.whole("substep", [](const P& p) { return p.sample->substep; });
  const auto whole = [&](const char* name, const char* description, auto get) {
    c.whole(name, [get](const P& p) { return get(p.sample->stale); }, description);
  };
  const auto real = [&](const char* name, const char* unit, auto get) {
    c.real(name, unit, [get](const P& p) { return get(p.sample->stale); });
  };
  using S = Staleness;
  whole("age", "substeps since the rebuild", [](const S& s) { return s.age; });
  whole("fluid_within", "pairs within H, both directions", [](const S& s) { return s.fluid.within; });
  whole("fluid_listed", "", [](const S& s) { return s.fluid.listed; });
  whole("fluid_missed", "", [](const S& s) { return s.fluid.missed; });
  whole("wall_within", "", [](const S& s) { return s.wall.within; });
  whole("wall_listed", "", [](const S& s) { return s.wall.listed; });
  whole("wall_missed", "", [](const S& s) { return s.wall.missed; });
  c.whole("proved", [](const P& p) { return p.sample->proved; }, "1: complete, by displacements");
  real("farthest", "m", [](const S& s) { return s.farthest; });
  real("wall_farthest", "m", [](const S& s) { return s.wall_farthest; });
  real("density_rms", "1", [](const S& s) { return s.density.relative_rms; });
  real("density_mean", "kg/m^3", [](const S& s) { return s.density.mean; });
  real("pressure_rms", "1", [](const S& s) { return s.pressure.relative_rms; });
  real("acceleration_rms", "1", [](const S& s) { return s.acceleration.relative_rms; });
  real("acceleration_mean", "m/s^2", [](const S& s) { return s.acceleration.mean; });
  real("acceleration_score", "1", [](const S& s) { return s.acceleration.score; });
  real("wall_acceleration_rms", "1", [](const S& s) { return s.wall_acceleration.relative_rms; });
}

void write_whole(Hdf5Writer& out, const std::vector<WholePour>& pours) {
  using W = WholePour;
  Columns<W> c(out, "/whole", pours);
  list_columns(c);
  c.whole("perturbation", [](const W& w) { return w.perturbation; }, "seed of a start perturbed by rounding; 0: none");
  c.text("trouble", [](const W& w) { return w.trouble.empty() ? "none" : w.trouble; });
  for (std::size_t p = 0; p < region_names.size(); ++p)
    c.real((std::string("share_") + region_names[p]).c_str(), "1", [p](const W& w) { return w.share_at[p]; });
  c.whole("inside", [](const W& w) { return w.inside; }, "particles seen inside a wall, most at once");
  c.real("kinetic_peak", "J", [](const W& w) { return w.kinetic_peak; });
  c.real("energy_lost", "J", [](const W& w) { return w.energy_lost; });
  c.real(
      "energy_drift", "1", [](const W& w) { return w.energy_drift; },
      "RMS difference from complete lists over the energy lost");
  c.real(
      "momentum_drift", "1", [](const W& w) { return w.momentum_drift; },
      "RMS difference from complete lists over the RMS momentum");
  c.real(
      "missed_share", "1", [](const W& w) { return w.missed_share; },
      "of the pairs within H over the pour, counted on the device");
  c.real("wall_missed_share", "1", [](const W& w) { return w.wall_missed_share; });
  c.real("rebuild_every", "1", [](const W& w) { return w.rebuild_every; }, "substeps, mean");
}

std::string name_of(const ListChoice& list) {
  return list.interval == 0 ? "auto" : list.interval < 0 ? "own" : fmt::format("{}", list.interval);
}

}  // namespace

std::string table(const std::vector<Result>& results) {
  std::string text;
  for (const Result& result : results) {
    text += fmt::format(
        "{}: {} particles, measured in {:.1f} s\n"
        "  {:>5} {:>5} {:>8} {:>8} {:>8} {:>8} {:>8} {:>6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8}\n",
        result.fixture, result.particles, result.measured_seconds, "every", "skin", "missed", "own", "worst",
        "expected", "wall's", "first", "proved", "density", "accel.", "expected", "wall's", "deviation", "us");
    for (const Row& row : result.rows) {
      const bool measured = row.list.interval != 0;
      const auto miss = [&](double share) { return measured ? percent(share) : "-"; };
      const auto error = [&](double e) { return measured ? number(e) : "-"; };
      text +=
          fmt::format("  {:>5} {:>5} {:>8} {:>8} {:>8} {:>8} {:>8} {:>6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8}\n",
                      name_of(row.list), number(row.list.skin, "{:.2f}") + (row.list.derived ? "*" : ""),
                      miss(row.missed_share), percent(row.own_missed_share), miss(row.worst_missed_share),
                      miss(row.expected.missed_share), miss(row.wall_missed_share),
                      !measured || row.first_miss == row.list.interval ? "-" : fmt::format("{}", row.first_miss),
                      !measured || row.proved_until < 0       ? "-"
                      : row.proved_until == row.list.interval ? "all"
                                                              : fmt::format("{}", row.proved_until),
                      error(row.density_rms), error(row.acceleration_rms), error(row.expected.acceleration_rms),
                      error(row.wall_acceleration_rms), number(row.deviation_over_ensemble, "{:.2f}"),
                      number(row.substep_us, "{:.1f}"));
    }
  }
  text += fmt::format("\n{:<28} {:>5} {:>9} {:>9} {:>9} {:>9}   powers of the relative motion\n", "safe interval",
                      "skin", "measured", "proved", "by speeds", "by pairs");
  for (const Result& result : results)
    for (const SafeInterval& safe : result.safe) {
      std::string powers;
      for (std::size_t k = 0; safe.skin == 0 && k < 3; ++k)
        powers += fmt::format("   {} {}±{} ({:.0f})", std::array{"missed", "density", "accel."}[k],
                              number(result.powers[k].power, "{:.2f}"), number(result.powers[k].confidence, "{:.2f}"),
                              result.edge_powers[k]);
      text += fmt::format("{:<28} {:>5.2f} {:>9} {:>9} {:>9} {:>9}{}\n", safe.fixture, safe.skin, safe.measured,
                          safe.proved, safe.expected, safe.expected_relative, powers);
    }
  return text;
}

std::string pour_table(const std::vector<PourResult>& pours) {
  std::string text;
  for (const PourResult& pour : pours) {
    if (pour.whole.empty()) continue;
    text += fmt::format(
        "\n{}, the whole pour\n  {:>9} {:>5} {:>10} {:>8} {:>8} {:>8} {:>7} "
        "{:>9} {:>9} {:>8} {:>8} {:>8}\n",
        pour.fixture, "every", "skin", "receiver", "source", "spilled", "lost", "inside", "energy", "momentum",
        "missed", "wall's", "rebuilt");
    for (const WholePour& w : pour.whole) {
      const std::string name = w.perturbation ? fmt::format("auto ±{}", w.perturbation) : name_of(w.list);
      if (!w.trouble.empty()) {
        text += fmt::format("  {:>9} {:>5} {}\n", name, number(w.list.skin, "{:.2f}"), w.trouble);
        continue;
      }
      const auto at = [&](Region place) { return percent(w.share_at[static_cast<std::size_t>(place)]); };
      text += fmt::format("  {:>9} {:>5} {:>10} {:>8} {:>8} {:>8} {:>7} {:>9} {:>9} {:>8} {:>8} {:>8.1f}\n", name,
                          number(w.list.skin, "{:.2f}"), at(Region::receiver), at(Region::source), at(Region::spilled),
                          at(Region::lost), w.inside, percent(w.energy_drift), percent(w.momentum_drift),
                          percent(w.missed_share), percent(w.wall_missed_share), w.rebuild_every);
    }
  }
  return text;
}

void write(const std::filesystem::path& file, const std::vector<Result>& results, const std::vector<PourResult>& pours,
           const BackendInfo& backend, const std::string& interrupted) {
  Hdf5Writer out(file);
  out.attribute("/", "decant_drift", 1);
  out.attribute("/", "backend", backend.name);
  out.attribute("/", "executor", backend.executor);
  out.attribute("/", "device", backend.device);
  for (const auto& [key, value] : build_provenance()) out.attribute("/provenance", key, value);
  if (!interrupted.empty()) out.attribute("/provenance", "interrupted", interrupted);
  std::vector<Row> rows;
  std::vector<Placed> samples, moments;
  std::vector<SafeInterval> safe;
  std::vector<WholePour> whole;
  for (const Result& result : results) {
    rows.insert(rows.end(), result.rows.begin(), result.rows.end());
    safe.insert(safe.end(), result.safe.begin(), result.safe.end());
    for (const Sample& s : result.samples) samples.push_back({result.fixture, not_measured, s.list, &s});
  }
  for (const PourResult& pour : pours) {
    whole.insert(whole.end(), pour.whole.begin(), pour.whole.end());
    for (const PourMoment& moment : pour.moments)
      moments.push_back({pour.fixture, moment.time, moment.sample.list, &moment.sample});
  }
  write_rows(out, rows);
  write_samples(out, "/samples", samples);
  write_samples(out, "/pour", moments);
  write_whole(out, whole);
  {
    using S = SafeInterval;
    Columns<S> c(out, "/safe", safe);
    c.text("fixture", [](const S& s) { return s.fixture; });
    c.real("skin", "1", [](const S& s) { return s.skin; });
    c.whole("measured", [](const S& s) { return s.measured; }, "substeps; at most the window");
    c.whole("proved", [](const S& s) { return s.proved; }, "by the displacements seen");
    c.whole("expected", [](const S& s) { return s.expected; }, "by the first state's speeds");
    c.whole(
        "expected_relative", [](const S& s) { return s.expected_relative; },
        "by how fast the first state's pairs near H approach");
  }
  using R = Result;
  Columns<R> c(out, "/fixtures", results);
  c.text("name", [](const R& r) { return r.fixture; });
  c.whole("particles", [](const R& r) { return r.particles; });
  c.real("support_radius", "m", [](const R& r) { return r.support_radius; });
  c.real("measured_seconds", "s", [](const R& r) { return r.measured_seconds; });
  c.real("run_seconds", "s", [](const R& r) { return r.run_seconds; }, "of them, timing and following the lists");
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string name = std::array{"missed", "density", "acceleration"}[k];
    c.real((name + "_power").c_str(), "1", [k](const R& r) { return r.powers[k].power; },
           "of the relative motion since the build, without skin");
    c.real((name + "_power_confidence").c_str(), "1", [k](const R& r) { return r.powers[k].confidence; },
           "half width, 95 %");
    c.real((name + "_power_expected").c_str(), "1", [k](const R& r) { return r.edge_powers[k]; });
  }
  out.commit();
}

}  // namespace decant::drift
