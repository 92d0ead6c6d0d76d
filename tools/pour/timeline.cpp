/// \file
/// Rows, their columns in HDF5, and the summary.
#include "tools/pour/timeline.hpp"

#include "reference/error.hpp"
#include "tools/common/build_provenance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace decant::pour {
namespace {

struct RealColumn {
  const char *name, *unit, *description;
  double TimelineRow::* member;
};
constexpr RealColumn real_columns[] = {
    {"time", "s", "time of the frame", &TimelineRow::time},
    {"kinetic_energy", "J", "of the fluid", &TimelineRow::kinetic_energy},
    {"potential_energy", "J", "of the fluid, zero at the origin", &TimelineRow::potential_energy},
    {"max_speed", "m/s", "largest speed of a particle", &TimelineRow::max_speed},
    {"min_density", "kg/m³", "smallest density of a particle", &TimelineRow::min_density},
    {"max_density", "kg/m³", "largest density of a particle", &TimelineRow::max_density},
    {"max_pressure", "Pa", "largest pressure of a particle", &TimelineRow::max_pressure},
    {"deepest", "m", "largest depth of a particle inside a solid", &TimelineRow::deepest},
    {"solver_seconds", "s", "wall time of advancing to this frame", &TimelineRow::solver_seconds},
    {"wall_seconds", "s", "wall time since the start", &TimelineRow::wall_seconds},
};

struct IntegerColumn {
  const char *name, *description;
  std::int64_t TimelineRow::* member;
};
constexpr IntegerColumn integer_columns[] = {
    {"frame", "number of the frame; 0 is the initial state", &TimelineRow::frame},
    {"substep", "substeps since the start", &TimelineRow::substep},
    {"deepest_particle", "particle deepest inside a solid, or -1", &TimelineRow::deepest_particle},
    {"fastest_particle", "particle of the largest speed, or -1", &TimelineRow::fastest_particle},
    {"densest_particle", "particle of the largest density, or -1", &TimelineRow::densest_particle},
    {"inside", "particles inside a solid", &TimelineRow::inside},
    {"crossed", "particles whose path since the frame before leads through a wall", &TimelineRow::crossed},
    {"first_crossed", "the first of them, or -1", &TimelineRow::first_crossed},
};

template <class Values, class Rows, class Get>
Values column(const Rows& rows, Get get) {
  Values values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t r = 0; r < rows.size(); ++r) values[static_cast<Eigen::Index>(r)] = get(rows[r]);
  return values;
}

}  // namespace

void require_finite(const Fields& fields, std::int64_t substep) {
  if (all_finite(fields.density) && all_finite(fields.pressure)) return;
  for (Eigen::Index i = 0; i < fields.density.size(); ++i)
    if (!std::isfinite(fields.density[i]) || !std::isfinite(fields.pressure[i]))
      throw BackendError(fmt::format("particle {}, substep {}: density {}, pressure {}", i, substep, fields.density[i],
                                     fields.pressure[i]));
}

TimelineRow timeline_row(std::int64_t frame, const Scene& scene, const ParticleState& state, const Fields& fields,
                         const AuditResult& audit) {
  TimelineRow row;
  row.frame = frame;
  row.substep = state.substep;
  row.time = scene.time_at(state.substep);
  row.particles_at = audit.particles_at;
  row.mass_at = audit.mass_at;
  row.kinetic_energy = audit.kinetic_energy;
  row.potential_energy = audit.potential_energy;
  row.max_speed = audit.max_speed;
  row.min_density = fields.density.minCoeff();
  Eigen::Index densest = -1;
  row.max_density = fields.density.maxCoeff(&densest);
  row.densest_particle = densest;
  row.max_pressure = fields.pressure.maxCoeff();
  row.deepest = audit.deepest;
  row.deepest_particle = audit.deepest_particle;
  row.inside = audit.inside;
  row.crossed = audit.crossed;
  row.first_crossed = audit.first_crossed;
  return row;
}

StageTimes operator+(const StageTimes& a, const StageTimes& b) {
  StageTimes sum = a;
  for (const StageName& s : stage_names) {
    (sum.*s.stage).seconds += (b.*s.stage).seconds;
    (sum.*s.stage).calls += (b.*s.stage).calls;
  }
  return sum;
}

StageTimes operator-(const StageTimes& now, const StageTimes& before) {
  StageTimes since = now;
  for (const StageName& s : stage_names) {
    (since.*s.stage).seconds -= (before.*s.stage).seconds;
    (since.*s.stage).calls -= (before.*s.stage).calls;
  }
  return since;
}

void Timeline::write(Hdf5Writer& out, const std::string& group) const {
  for (const RealColumn& c : real_columns)
    out.vector(group + "/" + c.name, column<Eigen::VectorXd>(rows, [&](const TimelineRow& r) { return r.*c.member; }),
               c.unit, c.description);
  for (const IntegerColumn& c : integer_columns)
    out.integers(group + "/" + c.name, column<IdVector>(rows, [&](const TimelineRow& r) { return r.*c.member; }),
                 c.description);
  for (std::size_t p = 0; p < region_names.size(); ++p) {
    out.vector(group + "/mass/" + region_names[p],
               column<Eigen::VectorXd>(rows, [&](const TimelineRow& r) { return r.mass_at[p]; }), "kg",
               "fluid at this place");
    out.integers(group + "/particles/" + region_names[p],
                 column<IdVector>(rows, [&](const TimelineRow& r) { return r.particles_at[p]; }),
                 "particles at this place");
  }
  out.strings(group + "/stages/name",
              {stage_names[0].name, stage_names[1].name, stage_names[2].name, stage_names[3].name},
              "stage of a substep");
  out.vector(group + "/stages/seconds",
             column<Eigen::VectorXd>(stage_names, [&](const StageName& s) { return (stages.*s.stage).seconds; }), "s",
             "wall time by stage, whole pour");
  out.integers(group + "/stages/calls",
               column<IdVector>(stage_names, [&](const StageName& s) { return (stages.*s.stage).calls; }),
               "passes by stage, whole pour");
}

Timeline Timeline::read(const Hdf5Reader& in, const std::string& group) {
  Timeline timeline;
  const std::int64_t n = in.vector(group + "/time").size();
  timeline.rows.resize(static_cast<std::size_t>(n));
  const auto fill = [&](const auto& values, auto set) {
    for (std::size_t r = 0; r < timeline.rows.size(); ++r) set(timeline.rows[r], values[static_cast<Eigen::Index>(r)]);
  };
  for (const RealColumn& c : real_columns)
    fill(in.vector(group + "/" + c.name, n), [&](TimelineRow& r, double v) { r.*c.member = v; });
  for (const IntegerColumn& c : integer_columns)
    fill(in.integers(group + "/" + c.name, n), [&](TimelineRow& r, std::int64_t v) { r.*c.member = v; });
  for (std::size_t p = 0; p < region_names.size(); ++p) {
    fill(in.vector(group + "/mass/" + region_names[p], n), [&](TimelineRow& r, double v) { r.mass_at[p] = v; });
    fill(in.integers(group + "/particles/" + region_names[p], n),
         [&](TimelineRow& r, std::int64_t v) { r.particles_at[p] = v; });
  }
  const auto count = static_cast<std::int64_t>(stage_names.size());
  const Eigen::VectorXd seconds = in.vector(group + "/stages/seconds", count);
  const IdVector calls = in.integers(group + "/stages/calls", count);
  for (std::size_t s = 0; s < stage_names.size(); ++s)
    timeline.stages.*
        stage_names[s].stage = {seconds[static_cast<Eigen::Index>(s)], calls[static_cast<Eigen::Index>(s)]};
  return timeline;
}

void write_timeline(const std::filesystem::path& file, const Timeline& timeline, const std::string& scene_json,
                    const std::map<std::string, std::string>& texts) {
  Hdf5Writer out(file);
  out.text("/scene", scene_json, "canonical JSON");
  timeline.write(out, "");
  for (const auto& [name, text] : texts) out.attribute("/", name, text);
  for (const auto& [name, text] : build_provenance()) out.attribute("/provenance", name, text);
  out.commit();
}

Summary summarise(const Timeline& timeline, std::int64_t particles, double mass) {
  Summary s;
  if (timeline.rows.empty()) return s;
  s.particles = particles;
  s.mass = mass * static_cast<double>(particles);
  for (const TimelineRow& row : timeline.rows) {
    std::int64_t counted = 0;
    double weighed = 0;
    for (std::size_t p = 0; p < region_names.size(); ++p) {
      counted += row.particles_at[p];
      weighed += row.mass_at[p];
    }
    // Five products and four sums in double, each rounded once.
    const bool adds_up = counted == particles && std::abs(weighed - s.mass) <= 1e-14 * s.mass;
    s.unbalanced_frames += !adds_up;
    s.frames_inside += row.inside > 0;
    s.crossings += row.crossed;
    s.deepest = std::max(s.deepest, row.deepest);
    if ((row.inside > 0 || row.crossed > 0) && !s.penetrated()) {
      s.penetration_frame = row.frame;
      s.penetration_particle = row.crossed > 0 ? row.first_crossed : row.deepest_particle;
    }
    if (row.kinetic_energy > s.peak_kinetic_energy) {
      s.peak_kinetic_energy = row.kinetic_energy;
      s.peak_kinetic_time = row.time;
    }
    s.max_speed = std::max(s.max_speed, row.max_speed);
    s.max_density = std::max(s.max_density, row.max_density);
    s.solver_seconds += row.solver_seconds;
  }
  const TimelineRow& last = timeline.rows.back();
  s.frames = last.frame;
  s.substeps = last.substep;
  s.mass_at = last.mass_at;
  for (std::size_t p = 0; p < region_names.size(); ++p) s.fraction_at[p] = s.mass_at[p] / s.mass;
  s.final_kinetic_energy = last.kinetic_energy;
  s.wall_seconds = last.wall_seconds;
  if (s.substeps > 0) s.seconds_per_substep = s.solver_seconds / static_cast<double>(s.substeps);
  return s;
}

}  // namespace decant::pour
