/// \file
/// Shapes for drawing, and numbers by name.
#include "tools/live/page_messages.hpp"

#include "reference/pose.hpp"
#include "reference/scene_limits.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

namespace decant::live {
namespace {

using nlohmann::ordered_json;

ordered_json vector_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

ordered_json shape_json(const Container& container, const LiveScene& scene) {
  ordered_json out = {{"name", container.name}, {"tilts", container.tilt.has_value()}};
  if (container.tilt) {
    const double degrees = 180 / std::numbers::pi;
    double least = 0, largest = 0;
    for (const TiltKey& key : container.tilt->keys) {
      least = std::min(least, key.angle * degrees);
      largest = std::max(largest, key.angle * degrees);
    }
    out["degrees"] = {std::min(least, -180.0), std::max(largest, 180.0)};
    out["hand_degrees_per_second"] = scene.hand_rate(container) * degrees;
  }
  if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
    out["profile"] = revolved->profile;
    return out;
  }
  out["boxes"] = ordered_json::array();
  for (const SolidBox& box : std::get<BoxShape>(container.shape).solid)
    out["boxes"].push_back({vector_json(box.min), vector_json(box.max)});
  return out;
}

/// Microseconds of one pass; none: nothing was timed.
ordered_json microseconds(const StageTimes::Stage& stage) {
  return stage.calls > 0 ? ordered_json(1e6 * stage.seconds / static_cast<double>(stage.calls)) : ordered_json();
}

}  // namespace

ordered_json scene_message(const LiveScene& live, Eigen::Index particles, Eigen::Index wall_particles,
                           const BackendInfo& info, const std::string& choice,
                           const std::vector<std::string>& backends) {
  const Scene& scene = live.running();
  ordered_json out = {{"type", "scene"},
                      {"name", scene.name},
                      {"text", live.text()},
                      {"particles", particles},
                      {"wall_particles", wall_particles},
                      {"spacing", scene.particle_spacing},
                      {"min", vector_json(scene.domain.min)},
                      {"max", vector_json(scene.domain.max)},
                      {"floor", scene.floor ? ordered_json(scene.floor->height) : ordered_json()},
                      {"gravity", vector_json(scene.gravity)},
                      {"viscosity", scene.fluid.viscosity},
                      {"sound_speed", scene.fluid.sound_speed},
                      {"backend", choice},
                      {"backends", backends},
                      {"device", info.device},
                      {"executor", info.executor},
                      {"precision", info.precision},
                      {"warnings", live.warnings()}};
  out["containers"] = ordered_json::array();
  for (const Container& container : scene.containers) out["containers"].push_back(shape_json(container, live));
  out["levels"] = ordered_json::array();
  for (std::size_t k = 0; k < scene.fills.size(); ++k)
    if (const Fill& fill = scene.fills[k]; !fill.box && !fill.round)
      out["levels"].push_back({{"fill", k}, {"container", fill.container}, {"level", fill.level}});
  return out;
}

ordered_json status_message(const Scene& scene, const LoopStatus& loop, std::int64_t substep,
                            const AuditResult& audit) {
  const double time = scene.time_at(substep);
  ordered_json out = {{"type", "status"},
                      {"time", time},
                      {"substep", substep},
                      {"paused", loop.paused},
                      {"speed", loop.speed},
                      {"substeps_per_second", loop.substeps_per_second},
                      {"scene_per_second", loop.scene_per_second},
                      {"pictures_per_second", loop.pictures_per_second},
                      {"kinetic_energy", audit.kinetic_energy},
                      {"potential_energy", audit.potential_energy},
                      {"max_speed", audit.max_speed},
                      {"inside", audit.inside},
                      {"crossed", audit.crossed},
                      {"mean_neighbors", loop.neighbors.mean_fluid + loop.neighbors.mean_wall},
                      {"device_bytes", loop.neighbors.device_bytes},
                      {"rebuilds", loop.neighbors.rebuilds}};
  out["by_hand"] = ordered_json::object();
  for (const auto& [name, degrees] : loop.by_hand) out["by_hand"][name] = degrees;
  if (!loop.failed.empty()) out["failed"] = loop.failed;
  for (std::size_t k = 0; k < region_names.size(); ++k) out["mass"][region_names[k]] = audit.mass_at[k];
  out["stages"] = {{"build", microseconds(loop.stages.build)},
                   {"density", microseconds(loop.stages.density)},
                   {"force", microseconds(loop.stages.force)},
                   {"integrate", microseconds(loop.stages.integrate)}};
  if (const PairTotals& pairs = loop.neighbors.verified; pairs.pairs + pairs.wall_pairs > 0)
    out["missed_pairs"] = pairs.missed + pairs.wall_missed;
  for (const Container& container : scene.containers)
    if (container.tilt) out["degrees"][container.name] = tilt_at(*container.tilt, time).angle * 180 / std::numbers::pi;
  const SceneLimits limits = limits_of(scene);
  if (audit.max_speed > limits.time_step_speed)
    out["beyond"] = fmt::format("{:.3g} m/s, faster than the {:.3g} m/s that the time step was derived for",
                                audit.max_speed, limits.time_step_speed);
  return out;
}

ordered_json scores_message(const Scores& scores) {
  ordered_json out = {
      {"type", "scores"}, {"time", scores.time}, {"particle", scores.particle}, {"field", scores.field}};
  // JSON has no infinity.
  if (std::isfinite(scores.largest)) out["largest"] = scores.largest;
  return out;
}

}  // namespace decant::live
