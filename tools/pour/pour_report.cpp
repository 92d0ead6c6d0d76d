/// \file
/// A pour's end as JSON and as lines for people.
#include "tools/pour/pour_report.hpp"

#include "oracle/checks/audit.hpp"
#include "tools/common/build_provenance.hpp"
#include "tools/common/progress.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace decant::pour {

std::string result_json(const Result& result, const BackendInfo& info, const std::string& out) {
  const Summary& s = result.summary;
  nlohmann::ordered_json places, stages;
  for (std::size_t p = 0; p < region_names.size(); ++p)
    places[region_names[p]] = {{"mass_kg", s.mass_at[p]}, {"fraction", s.fraction_at[p]}};
  for (const StageName& stage : stage_names) {
    const StageTimes::Stage& time = result.timeline.stages.*stage.stage;
    stages[stage.name] = {{"seconds", time.seconds}, {"calls", time.calls}};
  }
  nlohmann::ordered_json exceeded = nlohmann::ordered_json::array();
  for (const LimitExceeded& e : result.limits_exceeded)
    exceeded.push_back({{"limit", e.limit},
                        {"unit", e.unit},
                        {"bound", e.bound},
                        {"frame", e.frame},
                        {"particle", e.particle},
                        {"value", e.value},
                        {"largest", e.largest},
                        {"frames", e.frames}});
  nlohmann::ordered_json ranks;
  if (result.ranks.migrations > 0)
    ranks = {{"ghosts", result.ranks.ghosts},
             {"migrations", result.ranks.migrations},
             {"rebalances", result.ranks.rebalances},
             {"largest_imbalance", result.ranks.largest_imbalance}};
  const nlohmann::ordered_json all = {
      {"out", out},
      {"finished", result.finished},
      {"backend", info.name},
      {"options", info.options},
      {"executor", info.executor},
      {"device", info.device},
      {"precision", info.precision},
      {"particles", s.particles},
      {"frames", s.frames},
      {"substeps", s.substeps},
      {"mass_kg", s.mass},
      {"places", places},
      {"mass_adds_up", s.balanced()},
      {"unbalanced_frames", s.unbalanced_frames},
      {"penetrated", s.penetrated()},
      {"frames_inside_wall", s.frames_inside},
      {"wall_crossings", s.crossings},
      {"deepest_m", s.deepest},
      {"penetration_frame", s.penetration_frame},
      {"penetration_particle", s.penetration_particle},
      {"kinetic_energy_end_J", s.final_kinetic_energy},
      {"kinetic_energy_peak_J", s.peak_kinetic_energy},
      {"kinetic_energy_peak_s", s.peak_kinetic_time},
      {"max_speed_m_s", s.max_speed},
      {"max_density_kg_m3", s.max_density},
      {"within_limits", result.limits_exceeded.empty()},
      {"limits_exceeded", exceeded},
      {"solver_seconds", s.solver_seconds},
      {"fields_seconds", result.fields_seconds},
      {"wait_seconds", result.wait_seconds},
      {"wall_seconds", s.wall_seconds},
      {"substep_us", 1e6 * s.seconds_per_substep},
      {"stages", stages},
      {"ranks", ranks},
      {"provenance", build_provenance()},
  };
  return all.dump(2);
}

void print_result(const Result& result, const BackendInfo& info, const Scene& scene) {
  const Summary& s = result.summary;
  fmt::print("{}: {} particles, {} frames, {} substeps of {:.3g} s; {} ({}) on {}\n", scene.name, s.particles, s.frames,
             s.substeps, scene.time_step(), info.name, info.precision, info.device);
  for (std::size_t p = 0; p < region_names.size(); ++p)
    fmt::print("  {:<10} {:9.3f} g {:7.2f} %\n", region_names[p], 1e3 * s.mass_at[p], 1e2 * s.fraction_at[p]);
  fmt::print(
      "  {:<10} {:9.3f} g, {}\n", "all", 1e3 * s.mass,
      s.balanced() ? "added up at every frame" : fmt::format("DID NOT ADD UP at {} frames", s.unbalanced_frames));
  if (s.penetrated())
    fmt::print(
        "  walls      PENETRATED first at frame {} by particle {}; {} frames with particles "
        "inside a wall, {} crossings, deepest {:.3g} mm\n",
        s.penetration_frame, s.penetration_particle, s.frames_inside, s.crossings, 1e3 * s.deepest);
  else fmt::print("  walls      nothing inside a wall and nothing through one at any frame\n");
  fmt::print("  energy     kinetic {:.3g} J at the end, peak {:.3g} J at {:.3f} s\n", s.final_kinetic_energy,
             s.peak_kinetic_energy, s.peak_kinetic_time);
  fmt::print("  extremes   {:.3g} m/s, {:.1f} kg/m³\n", s.max_speed, s.max_density);
  for (const LimitExceeded& e : result.limits_exceeded)
    fmt::print("  BEYOND     {}; {} frames, at most {:.4g} {}\n", describe(e), e.frames, e.largest, e.unit);
  fmt::print("  time       {} in all; solver {:.4g} µs per substep", duration_text(s.wall_seconds),
             1e6 * s.seconds_per_substep);
  for (const StageName& stage : stage_names)
    if (const StageTimes::Stage& time = result.timeline.stages.*stage.stage; time.calls > 0)
      fmt::print(", {} {:.4g}", stage.name, 1e6 * time.seconds / static_cast<double>(time.calls));
  fmt::print("\n");
  if (result.ranks.migrations > 0)
    fmt::print("  ranks      {} migrations, largest imbalance {:.1f} %, {} ghosts at the end\n",
               result.ranks.migrations, 100 * (result.ranks.largest_imbalance - 1), result.ranks.ghosts);
  fmt::print("  beside it  fields of frames {:.3g} s, waiting for audit and disk {:.3g} s\n", result.fields_seconds,
             result.wait_seconds);
}

}  // namespace decant::pour
