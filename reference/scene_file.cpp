/// \file
/// The Scene that a file means: scene_format.cpp has keys, types and bounds; here is what takes several
/// values of one object. What takes the whole scene (overlap, time step, fill against cup) is scene_checks.cpp.
#include "reference/scene_file.hpp"

#include "reference/error.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_json_reader.hpp"
#include "reference/scene_motion_reader.hpp"
#include "reference/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

namespace decant {
namespace {

FluidProperties read_fluid(const JsonValue& v) {
  v.check_keys();
  FluidProperties fluid;
  fluid.rest_density = v["rest_density"].number();
  fluid.sound_speed = v["sound_speed"].number();
  fluid.viscosity = v["viscosity"].number();
  if (v.has("eos_exponent")) fluid.eos_exponent = v["eos_exponent"].number();
  if (v.has("allow_tension")) fluid.allow_tension = v["allow_tension"].boolean();
  fluid.wall_viscosity = v.has("wall_viscosity") ? v["wall_viscosity"].number() : 2.0 * fluid.viscosity;
  return fluid;
}

/// `min` and `max` of an object, which may have other keys.
SolidBox read_box(const JsonValue& v) {
  v.check_keys();
  const SolidBox box{v["min"].vector(), v["max"].vector()};
  for (int a = 0; a < 3; ++a)
    if (!(box.min[a] < box.max[a]))
      v["max"].elements()[static_cast<std::size_t>(a)].refuse("greater than min, which is " + to_text(box.min[a]));
  return box;
}

Domain read_domain(const JsonValue& v) {
  const SolidBox box = read_box(v);
  Domain domain{box.min, box.max, {false, false, false}};
  if (!v.has("periodic")) return domain;
  for (const auto& axis : v["periodic"].elements()) {
    const auto a = axis.choice();
    if (domain.periodic[a]) axis.refuse("each axis once");
    domain.periodic[a] = true;
  }
  return domain;
}

Contact read_contact(const JsonValue& v) {
  v.check_keys();
  Contact contact;
  if (v.has("distance_ratio")) contact.distance_ratio = v["distance_ratio"].number();
  if (v.has("restitution")) contact.restitution = v["restitution"].number();
  if (v.has("friction")) contact.friction = v["friction"].number();
  return contact;
}

double cross(const std::array<double, 2>& o, const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

RevolvedShape read_profile(const JsonValue& v) {
  RevolvedShape shape;
  const auto points = v.elements();
  for (const auto& point : points) {
    const auto rz = point.elements();
    shape.profile.push_back({rz[0].number(), rz[1].number()});
  }
  const auto& p = shape.profile;
  const std::size_t n = p.size();
  double area = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const auto& next = p[(k + 1) % n];
    if (p[k] == next) points[k].refuse("different from the point after it");
    area += 0.5 * (p[k][0] * next[1] - next[0] * p[k][1]);
  }
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t l = k + 2; l < n; ++l) {
      if (k == 0 && l == n - 1) continue;
      const auto &a = p[k], &b = p[k + 1], &c = p[l], &d = p[(l + 1) % n];
      if (cross(a, b, c) * cross(a, b, d) < 0 && cross(c, d, a) * cross(c, d, b) < 0)
        points[l].refuse(
            "an outline that does not cross itself; the edge from here meets that from"
            " point " +
            std::to_string(k));
    }
  if (!(area > 0)) v.refuse("an outline with the solid on its left (counter-clockwise in r, z)");
  return shape;
}

BoxShape read_tank(const JsonValue& v, const Domain& domain, double& wall_thickness) {
  v.check_keys();
  wall_thickness = v["wall_thickness"].number();
  const Vec3 size = v["size"].vector();
  OpenFaces open{};
  if (v.has("open"))
    for (const auto& face : v["open"].elements()) {
      const auto which = face.choice();
      bool& is_open = open[which / 2][which % 2];
      if (is_open) face.refuse("each face once");
      is_open = true;
    }
  for (std::size_t a = 0; a < 3; ++a) {
    const bool both_open = open[a][0] && open[a][1];
    if (domain.periodic[a] && !both_open) {
      const char axis = "xyz"[a];
      const std::string bound =
          std::string("both -") + axis + " and +" + axis + ", because the domain is periodic along " + axis;
      if (v.has("open")) v["open"].refuse(bound);
      throw InputError(v.file(), v.path() + ".open", "missing", bound);
    }
    // The walls end where a face is open, so the tank's extent is theirs.
    const auto axis = static_cast<Eigen::Index>(a);
    if (both_open && !domain.periodic[a] && size[axis] < wall_thickness)
      v["size"].elements()[a].refuse("no less than wall_thickness, which is " + to_text(wall_thickness) +
                                     ", where both faces are open");
  }
  return tank_shape(size, wall_thickness, open);
}

BoxShape read_boxes(const JsonValue& v, const Domain& domain, double& wall_thickness) {
  v.check_keys();
  wall_thickness = v["wall_thickness"].number();
  BoxShape shape;
  shape.cavity = read_box(v["cavity"]);
  for (const auto& box : v["solid"].elements()) {
    shape.solid.push_back(read_box(box));
    const Vec3 extent = shape.solid.back().max - shape.solid.back().min;
    for (std::size_t a = 0; a < 3; ++a)
      // Ends on a periodic axis are no surface, so that extent is no thickness.
      if (!domain.periodic[a] && extent[static_cast<Eigen::Index>(a)] < wall_thickness * (1 - 1e-9))
        box.refuse("no thinner than wall_thickness, which is " + to_text(wall_thickness));
  }
  return shape;
}

Container read_container(const JsonValue& v, const Domain& domain) {
  v.check_keys();
  Container container;
  container.name = v["name"].name();
  if (v.has("origin")) container.origin = v["origin"].vector();
  v.check_alternatives();
  if (v.has("cup")) {
    const JsonValue cup = v["cup"];
    cup.check_keys();
    container.wall_thickness = cup["wall_thickness"].number();
    container.shape = cup_shape(cup["inner_radius"].number(), cup["inner_height"].number(), container.wall_thickness);
  } else if (v.has("revolved")) {
    const JsonValue revolved = v["revolved"];
    revolved.check_keys();
    container.wall_thickness = revolved["wall_thickness"].number();
    container.shape = read_profile(revolved["profile"]);
  } else {
    BoxShape shape = v.has("tank") ? read_tank(v["tank"], domain, container.wall_thickness)
                                   : read_boxes(v["boxes"], domain, container.wall_thickness);
    shape.endless = domain.periodic;
    container.shape = std::move(shape);
  }
  if (v.has("tilt")) container.tilt = read_tilt(v["tilt"]);
  if (v.has("translation")) container.translation = read_translation(v["translation"]);
  if (v.has("surface_velocity")) container.surface_velocity = v["surface_velocity"].vector();
  return container;
}

/// The ball or rod of a fill.
RoundShape read_round(const JsonValue& fill) {
  const bool rod = fill.has("rod");
  const JsonValue v = fill[rod ? "rod" : "ball"];
  v.check_keys();
  RoundShape shape{v["center"].vector(), v["radius"].number()};
  if (rod) {
    shape.axis = static_cast<int>(v["axis"].choice());
    shape.length = v["length"].number();
  }
  return shape;
}

Fill read_fill(const JsonValue& v, const std::vector<Container>& containers) {
  v.check_keys();
  Fill fill;
  const auto name_of_container = [&](const JsonValue& name) {
    std::string names;
    for (const auto& c : containers) {
      if (c.name == name.text()) return c.name;
      names += (names.empty() ? "" : ", ") + c.name;
    }
    name.refuse("the name of a container: " + names);
  };
  if (v.has("container")) fill.container = name_of_container(v["container"]);
  if (v.has("around"))
    for (const auto& name : v["around"].elements()) {
      const std::string other = name_of_container(name);
      if (other == fill.container) name.refuse("another container than the one that is filled");
      if (std::find(fill.around.begin(), fill.around.end(), other) != fill.around.end())
        name.refuse("each container once");
      fill.around.push_back(other);
    }
  v.check_alternatives();
  if (v.has("level")) {
    if (fill.container.empty()) v["level"].refuse("a box, because no container is named");
    fill.level = v["level"].number();
  } else if (v.has("box")) {
    fill.box = read_box(v["box"]);
  } else {
    fill.round = read_round(v);
    fill.box = fill.round->bounds();
  }
  if (v.has("velocity")) fill.velocity = v["velocity"].vector();
  if (v.has("velocity_gradient")) {
    const JsonValue gradient = v["velocity_gradient"];
    gradient.check_keys();
    const auto rows = gradient["matrix"].elements();
    for (Eigen::Index a = 0; a < 3; ++a)
      fill.velocity_gradient.row(a) = rows[static_cast<std::size_t>(a)].vector().transpose();
    fill.gradient_about = gradient["about"].vector();
  }
  return fill;
}

Schedule read_time(const JsonValue& v) {
  v.check_keys();
  Schedule schedule;
  schedule.end = v["end"].number();
  schedule.frames = v["frames"].integer();
  if (v.has("courant")) schedule.courant = v["courant"].number();
  if (v.has("substeps_per_frame")) schedule.substeps_per_frame = v["substeps_per_frame"].integer();
  schedule.substeps_derived = !v.has("substeps_per_frame");
  if (v.has("substeps_derived")) {
    schedule.substeps_derived = v["substeps_derived"].boolean();
    if (!schedule.substeps_derived && schedule.substeps_per_frame == 0)
      v["substeps_derived"].refuse("true, because substeps_per_frame is missing");
  }
  if (v.has("max_speed")) schedule.max_speed = v["max_speed"].number();
  return schedule;
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& file) {
  const nlohmann::json json = parse_json(text, file);
  const ValueFormat format{ObjectReference{"scene"}};
  const JsonValue v(json, format, file, "");
  v.check_keys();
  v["decant_scene"].integer();
  if (v.has("$schema")) v["$schema"].text();
  Scene scene;
  scene.name = v["name"].name();
  scene.particle_spacing = v["particle_spacing"].number();
  if (v.has("kernel")) scene.kernel = static_cast<KernelFamily>(v["kernel"].choice());
  if (v.has("support_ratio")) scene.support_ratio = v["support_ratio"].number();
  if (v.has("mass_ratio")) scene.mass_ratio = v["mass_ratio"].number();
  scene.fluid = read_fluid(v["fluid"]);
  if (v.has("gravity")) scene.gravity = v["gravity"].vector();
  scene.domain = read_domain(v["domain"]);
  if (v.has("floor")) {
    v["floor"].check_keys();
    scene.floor = Floor{v["floor"]["height"].number()};
  }
  if (v.has("contact")) scene.contact = read_contact(v["contact"]);
  if (v.has("wall_layers")) scene.wall_layers = v["wall_layers"].integer();
  if (v.has("containers"))
    for (const auto& container : v["containers"].elements()) {
      scene.containers.push_back(read_container(container, scene.domain));
      for (std::size_t k = 0; k + 1 < scene.containers.size(); ++k)
        if (scene.containers[k].name == scene.containers.back().name)
          container["name"].refuse("a name of its own; containers[" + std::to_string(k) + "] has it already");
    }
  for (const auto& fill : v["fill"].elements()) scene.fills.push_back(read_fill(fill, scene.containers));
  scene.schedule = read_time(v["time"]);
  return scene;
}

std::string read_scene_text(const std::filesystem::path& file) {
  std::error_code ignored;
  std::ifstream in(file, std::ios::binary);
  if (std::filesystem::is_directory(file, ignored) || !in)
    throw InputError(file.string(), "(whole file)", "not readable", "a scene file");
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

Scene load_scene(const std::filesystem::path& file, std::vector<std::string>* warnings) {
  return complete_scene(read_scene_text(file), file.string(), warnings);
}

Scene complete_scene(const std::string& text, const std::string& name, std::vector<std::string>* warnings,
                     Distances distances) {
  Scene scene = parse_scene(text, name);
  try {
    if (scene.schedule.substeps_derived) scene.schedule.substeps_per_frame = substeps_for(scene);
  } catch (const InputError& error) {
    throw InputError(name, error.key(), error.value(), error.bound());
  }
  auto found = check_scene(scene, name, distances);
  if (warnings) *warnings = std::move(found);
  return scene;
}

}  // namespace decant
