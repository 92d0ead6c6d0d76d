/// \file
/// The canonical text of a scene: general shapes, radians, every value written out, so that nothing
/// depends on a default or on a conversion and the text reads back to the same bits.
#include "reference/scene_file.hpp"

#include <nlohmann/json.hpp>

namespace decant {
namespace {

using nlohmann::ordered_json;  // keeps the order of the format's description

ordered_json vector_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

ordered_json box_json(const SolidBox& box) { return {{"min", vector_json(box.min)}, {"max", vector_json(box.max)}}; }

ordered_json oscillation_json(ordered_json amplitude, double frequency, double phase) {
  return {{"amplitude", std::move(amplitude)}, {"frequency", frequency}, {"phase", phase}};
}

/// What older scenes lack stays away where it says nothing, so that their text keeps its bytes.
ordered_json tilt_json(const Tilt& tilt) {
  ordered_json keys = ordered_json::array();
  for (const auto& key : tilt.keys) keys.push_back({{"time", key.time}, {"angle", key.angle}});
  ordered_json out = {{"pivot", vector_json(tilt.pivot)}, {"axis", vector_json(tilt.axis)}, {"keys", keys}};
  if (tilt.rate != 0) out["rate"] = tilt.rate;
  if (const auto& o = tilt.oscillation) out["oscillation"] = oscillation_json(o->amplitude, o->frequency, o->phase);
  return out;
}

ordered_json translation_json(const Translation& translation) {
  ordered_json keys = ordered_json::array();
  for (const auto& key : translation.keys) keys.push_back({{"time", key.time}, {"offset", vector_json(key.offset)}});
  ordered_json out = {{"keys", keys}};
  if (!translation.velocity.isZero(0)) out["velocity"] = vector_json(translation.velocity);
  if (const auto& o = translation.oscillation)
    out["oscillation"] = oscillation_json(vector_json(o->amplitude), o->frequency, o->phase);
  return out;
}

ordered_json container_json(const Container& container) {
  ordered_json out = {{"name", container.name}};
  if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
    out["revolved"] = {{"profile", revolved->profile}, {"wall_thickness", container.wall_thickness}};
  } else {
    const auto& boxes = std::get<BoxShape>(container.shape);
    ordered_json solid = ordered_json::array();
    for (const auto& box : boxes.solid) solid.push_back(box_json(box));
    out["boxes"] = {{"cavity", box_json(boxes.cavity)}, {"solid", solid}, {"wall_thickness", container.wall_thickness}};
  }
  out["origin"] = vector_json(container.origin);
  if (container.tilt) out["tilt"] = tilt_json(*container.tilt);
  if (container.translation) out["translation"] = translation_json(*container.translation);
  if (!container.surface_velocity.isZero(0)) out["surface_velocity"] = vector_json(container.surface_velocity);
  return out;
}

ordered_json fill_json(const Fill& fill) {
  ordered_json out = ordered_json::object();
  if (!fill.container.empty()) out["container"] = fill.container;
  if (fill.round) {
    ordered_json& round = out[fill.round->axis < 0 ? "ball" : "rod"];
    round = {{"center", vector_json(fill.round->center)}, {"radius", fill.round->radius}};
    if (fill.round->axis >= 0) {
      round["axis"] = std::string(1, "xyz"[fill.round->axis]);
      round["length"] = fill.round->length;
    }
  } else if (fill.box) out["box"] = box_json(*fill.box);
  else out["level"] = fill.level;
  if (!fill.around.empty()) out["around"] = fill.around;
  out["velocity"] = vector_json(fill.velocity);
  if (!fill.velocity_gradient.isZero(0)) {
    ordered_json matrix = ordered_json::array();
    for (Eigen::Index a = 0; a < 3; ++a) matrix.push_back(vector_json(fill.velocity_gradient.row(a).transpose()));
    out["velocity_gradient"] = {{"matrix", matrix}, {"about", vector_json(fill.gradient_about)}};
  }
  return out;
}

}  // namespace

std::string scene_to_json(const Scene& scene) {
  ordered_json out;
  out["decant_scene"] = 1;
  out["name"] = scene.name;
  out["particle_spacing"] = scene.particle_spacing;
  out["kernel"] = to_string(scene.kernel);
  out["support_ratio"] = scene.support_ratio;
  out["mass_ratio"] = scene.mass_ratio;
  const auto& fluid = scene.fluid;
  out["fluid"] = {{"rest_density", fluid.rest_density}, {"sound_speed", fluid.sound_speed},
                  {"eos_exponent", fluid.eos_exponent}, {"allow_tension", fluid.allow_tension},
                  {"viscosity", fluid.viscosity},       {"wall_viscosity", fluid.wall_viscosity}};
  out["gravity"] = vector_json(scene.gravity);
  ordered_json periodic = ordered_json::array();
  for (std::size_t a = 0; a < 3; ++a)
    if (scene.domain.periodic[a]) periodic.push_back(std::string(1, "xyz"[a]));
  out["domain"] = {
      {"min", vector_json(scene.domain.min)}, {"max", vector_json(scene.domain.max)}, {"periodic", periodic}};
  if (scene.floor) out["floor"] = {{"height", scene.floor->height}};
  out["contact"] = {{"distance_ratio", scene.contact.distance_ratio},
                    {"restitution", scene.contact.restitution},
                    {"friction", scene.contact.friction}};
  out["wall_layers"] = scene.wall_layers;
  out["containers"] = ordered_json::array();
  for (const auto& container : scene.containers) out["containers"].push_back(container_json(container));
  out["fill"] = ordered_json::array();
  for (const auto& fill : scene.fills) out["fill"].push_back(fill_json(fill));
  ordered_json& time = out["time"];
  time = {{"end", scene.schedule.end}, {"frames", scene.schedule.frames}, {"courant", scene.schedule.courant}};
  if (scene.schedule.substeps_per_frame != 0) time["substeps_per_frame"] = scene.schedule.substeps_per_frame;
  time["substeps_derived"] = scene.schedule.substeps_derived;
  if (scene.schedule.max_speed) time["max_speed"] = *scene.schedule.max_speed;
  return out.dump(2);
}

}  // namespace decant
