/// \file
/// The table. Keys stand in the order of the format's description; defaults are those of the structs that
/// the reader fills.
#include "reference/scene_format.hpp"

#include "reference/scene.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace decant {
namespace {

using nlohmann::ordered_json;

constexpr Range positive{.low = 0.0, .high = 1e6, .low_open = true};
constexpr Range non_negative{.low = 0.0, .high = 1e6};
constexpr Range coordinate{.low = -1e4, .high = 1e4};   // m
constexpr Range speed{.low = -1e4, .high = 1e4};        // m/s
constexpr Range turns{.low = -1e6, .high = 1e6};        // rad or degrees; a double has 1e6 rad within 1e-10
constexpr Range phase_shift{.low = -1e3, .high = 1e3};  // rad

ValueFormat number(const Range& range, std::string description) {
  return {NumberFormat{range}, std::move(description)};
}

ValueFormat integer(int low, int high, std::string description) {
  return {IntegerFormat{low, high}, std::move(description)};
}

ValueFormat boolean(std::string description) { return {BooleanFormat{}, std::move(description)}; }

ValueFormat text(std::string description) { return {TextFormat{}, std::move(description)}; }

ValueFormat name(std::string description) { return {NameFormat{}, std::move(description)}; }

ValueFormat choice(std::vector<std::string> options, std::string description) {
  return {ChoiceFormat{std::move(options)}, std::move(description)};
}

ValueFormat list(ValueFormat item, std::size_t fewest, std::size_t most, std::string description) {
  return {ArrayFormat{{std::move(item)}, fewest, most}, std::move(description)};
}

/// A list without equal elements.
ValueFormat set(ValueFormat item, std::size_t fewest, std::size_t most, std::string description) {
  return {ArrayFormat{{std::move(item)}, fewest, most, true}, std::move(description)};
}

/// Three numbers.
ValueFormat vector(const Range& range, std::string description) {
  return list(number(range, {}), 3, 3, std::move(description));
}

ValueFormat object(std::string of, std::string description = {}) {
  return {ObjectReference{std::move(of)}, std::move(description)};
}

Member required(std::string key, ValueFormat value) { return {std::move(key), std::move(value), true}; }

Member optional(std::string key, ValueFormat value, ordered_json otherwise = {}) {
  return {std::move(key), std::move(value), false, std::move(otherwise)};
}

ordered_json json_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Alternatives one_of(std::vector<std::vector<std::string>> keys, std::string bound) {
  return {std::move(keys), true, std::move(bound)};
}

Alternatives some_of(std::vector<std::vector<std::string>> keys, std::string bound) {
  return {std::move(keys), false, std::move(bound)};
}

ObjectFormat scene_object() {
  const Scene defaults;
  return {
      "scene",
      "What a pour is made of; SI units.",
      {
          optional("$schema", text("For editors.")),
          required("decant_scene", integer(1, 1, "Version of the format.")),
          required("name", name("Output files carry it.")),
          required("particle_spacing", number({.low = 1e-6, .high = 1e3}, "dx, m")),
          optional("kernel", choice({kernel_names.begin(), kernel_names.end()}, "Family of radial functions."),
                   to_string(defaults.kernel)),
          optional("support_ratio", number({.low = 1.5, .high = 5.0}, "H / dx"), defaults.support_ratio),
          optional("mass_ratio", number({.low = 0.5, .high = 2.0}, "m / (rho0 dx³)"), defaults.mass_ratio),
          required("fluid", object("fluid")),
          optional("gravity", vector({.low = -1e4, .high = 1e4}, "m/s², or any constant body force"),
                   json_of(defaults.gravity)),
          required("domain", object("domain")),
          optional("floor", object("floor")),
          optional("contact", object("contact")),
          optional("wall_layers", integer(1, 8, "Layers of wall particles inside the solid."), defaults.wall_layers),
          optional("containers", list(object("container"), 0, 100, "At least H apart at all times.")),
          required("fill", list(object("fill"), 1, 1000, "At least one; they do not overlap.")),
          required("time", object("time")),
      }};
}

ObjectFormat fluid_object() {
  const FluidProperties defaults;
  return {"fluid",
          "Material of the fluid.",
          {
              required("rest_density", number(positive, "kg/m³")),
              required("sound_speed", number(positive, "m/s; at least 4 times the speed to expect")),
              optional("eos_exponent", {NumberFormat{{}, {7, 1}}, "gamma in p = B((rho/rho0)^gamma - 1)"},
                       defaults.eos_exponent),
              optional("allow_tension", boolean("false: p = max(p, 0)"), defaults.allow_tension),
              required("viscosity", number(non_negative, "Pa·s")),
              optional("wall_viscosity", number(non_negative, "Pa·s; twice the viscosity where it is not given")),
          }};
}

/// The object that has `min` and `max`, and what it is.
ObjectFormat box_object(std::string of, std::string description) {
  return {std::move(of),
          std::move(description),
          {required("min", vector(coordinate, "m")), required("max", vector(coordinate, "m, greater than min"))}};
}

ObjectFormat domain_object() {
  ObjectFormat domain = box_object("domain", "Where particles may be.");
  domain.members.push_back(optional(
      "periodic", set(choice({"x", "y", "z"}, {}), 0, 3, "Axes along which particles come back in on the other side."),
      ordered_json::array()));
  return domain;
}

ObjectFormat contact_object() {
  const Contact defaults;
  return {"contact",
          "Last resort against passing through a wall.",
          {
              // The lattice starts dx/2 from the walls: a longer contact distance would move it at once.
              optional("distance_ratio", number({.low = 0.0, .high = 0.5}, "contact distance / dx"),
                       defaults.distance_ratio),
              optional("restitution", number({.low = 0.0, .high = 1.0}, "0: no bounce"), defaults.restitution),
              optional("friction", number(non_negative, "share of the normal impulse taken from the tangential speed"),
                       defaults.friction),
          }};
}

ObjectFormat container_object() {
  const Container defaults;
  return {"container",
          "Rigid solid. Exactly one of cup, tank, revolved, boxes.",
          {
              required("name", name("Unique; fills refer to it.")),
              optional("cup", object("cup")),
              optional("tank", object("tank")),
              optional("revolved", object("revolved")),
              optional("boxes", object("boxes")),
              optional("origin", vector(coordinate, "m, world position of the container's frame while it is not moved"),
                       json_of(defaults.origin)),
              optional("tilt", object("tilt")),
              optional("translation", object("translation")),
              optional("surface_velocity",
                       vector(speed, "m/s, container's frame: the surface runs like a belt, the container stays"),
                       json_of(defaults.surface_velocity)),
          },
          one_of({{"cup"}, {"tank"}, {"revolved"}, {"boxes"}}, "exactly one of cup, tank, revolved, boxes")};
}

std::vector<ObjectFormat> shape_objects() {
  return {
      {"cup",
       "Round cup, open at the top; the frame's origin is the middle of the inner bottom.",
       {
           required("inner_radius", number(positive, "m")),
           required("inner_height", number(positive, "m")),
           required("wall_thickness", number(positive, "m, of wall and bottom, at least H")),
       }},
      {"tank",
       "Box whose cavity goes from the frame's origin to size.",
       {
           required("size", vector(positive, "m, the cavity")),
           required("wall_thickness", number(positive, "m, at least H")),
           optional("open",
                    set(choice({"-x", "+x", "-y", "+y", "-z", "+z"}, {}), 0, 5,
                        "Faces that are missing; both along a periodic axis."),
                    ordered_json::array()),
       }},
      {"revolved",
       "Solid of revolution about the frame's z axis.",
       {
           required(
               "profile",
               list({ArrayFormat{
                        {number({.low = 0.0, .high = coordinate.high}, "r, m"), number(coordinate, "z, m")}, 2, 2}},
                    3, 1000, "Closed outline [r, z] in m, solid on its left.")),
           required("wall_thickness", number(positive, "m, of the thinnest wall, at least H")),
       }},
      {"boxes",
       "Union of boxes about a cavity, container frame.",
       {
           required("cavity", object("box", "The room that counts as in this container.")),
           required("solid", list(object("box"), 1, 1000, "Boxes; may touch and overlap.")),
           required("wall_thickness", number(positive, "m, of the thinnest box, at least H")),
       }},
      box_object("box", "Axis-aligned box."),
  };
}

/// \param amplitude  of the angle or of the offset
ObjectFormat oscillation_object(std::string of, ValueFormat amplitude) {
  return {std::move(of),
          "Adds amplitude · sin(2π frequency t + phase).",
          {
              required("amplitude", std::move(amplitude)),
              required("frequency", number(positive, "Hz")),
              optional("phase", number(phase_shift, "rad"), Oscillation<double>{}.phase),
          }};
}

std::vector<ObjectFormat> motion_objects() {
  const char* after_last = " after the last key; the last smoothstep of two or more keys ends with it";
  return {
      {"tilt",
       "Rotation about a line; the angle follows 3s² - 2s³ between keys, rests before them and goes on at `rate` after "
       "them; an oscillation is added.",
       {
           required("pivot", vector(coordinate, "m, a point of the line, world before any translation")),
           required("axis", vector(coordinate, "Direction of the line, any length; right-handed")),
           optional("keys", list(object("tilt_key"), 1, 10000, "Times increase. Without keys: angle 0 at time 0.")),
           optional("rate", number(turns, std::string("rad/s") + after_last), Tilt{}.rate),
           optional("oscillation", object("tilt_oscillation")),
       },
       some_of({{"keys"}, {"rate"}, {"oscillation"}}, "at least one of keys, rate, oscillation")},
      {"tilt_key",
       "Angle at one time. Exactly one of angle and angle_deg.",
       {
           required("time", number(non_negative, "s")),
           optional("angle", number(turns, "rad, any number of turns")),
           optional("angle_deg", number(turns, "degrees, any number of turns")),
       },
       one_of({{"angle"}, {"angle_deg"}}, "exactly one of angle (rad) and angle_deg")},
      oscillation_object("tilt_oscillation", number(turns, "rad")),
      {"translation",
       "Moves the container, and the line of its tilt, by the rules of a tilt.",
       {
           optional("keys",
                    list(object("translation_key"), 1, 10000, "Times increase. Without keys: offset 0 at time 0.")),
           optional("velocity", vector(speed, std::string("m/s") + after_last), json_of(Translation{}.velocity)),
           optional("oscillation", object("translation_oscillation")),
       },
       some_of({{"keys"}, {"velocity"}, {"oscillation"}}, "at least one of keys, velocity, oscillation")},
      {"translation_key",
       "Offset at one time.",
       {required("time", number(non_negative, "s")), required("offset", vector(coordinate, "m, world"))}},
      oscillation_object("translation_oscillation", vector(coordinate, "m, world")),
  };
}

std::vector<ObjectFormat> fill_objects() {
  const char* frame = "In the container's frame where one is named, else in the world.";
  return {
      {"fill",
       "Fluid at the start: a level in a container, or a box, a ball or a rod in a container's frame or in the world.",
       {
           optional("container", text("Name of a container.")),
           optional("level", number(positive, "m above the inner bottom")),
           optional("box", object("box", frame)),
           optional("ball", object("ball", frame)),
           optional("rod", object("rod", frame)),
           optional("around", set(text({}), 1, 100,
                                  "Names of other containers in the fluid's place: no particle starts within dx/2 of "
                                  "their solids.")),
           optional("velocity", vector(speed, "m/s"), json_of(Fill{}.velocity)),
           optional("velocity_gradient", object("velocity_gradient")),
       },
       one_of({{"level", "container"}, {"box"}, {"ball"}, {"rod"}}, "exactly one of level, box, ball, rod")},
      {"ball",
       "A ball; the lattice lies evenly about its center.",
       {required("center", vector(coordinate, "m")), required("radius", number(positive, "m"))}},
      {"rod",
       "A rod along an axis; one as long as the domain's period goes on across it.",
       {
           required("center", vector(coordinate, "m")),
           required("radius", number(positive, "m")),
           required("axis", choice({"x", "y", "z"}, {})),
           required("length", number(positive, "m, half of it on either side of the center")),
       }},
      {"velocity_gradient",
       "Adds matrix (x - about) to the velocity of a particle at x, world.",
       {
           required("matrix", list(vector({.low = -1e6, .high = 1e6}, {}), 3, 3, "1/s, row by row")),
           required("about", vector(coordinate, "m")),
       }},
  };
}

ObjectFormat time_object() {
  return {
      "time",
      "Length, frames and substeps.",
      {
          required("end", number(positive, "s")),
          required("frames", integer(1, 1000000, "Frames written after the initial one.")),
          optional("courant", number({.low = 0.0, .high = 0.4, .low_open = true}, "dt <= courant · h / (c0 + v_max)"),
                   Schedule{}.courant),
          optional("substeps_per_frame", integer(1, 1000000000, "Instead of deriving it.")),
          optional("substeps_derived",
                   boolean("true: substeps_per_frame only records what was derived; loading derives it anew.")),
          optional("max_speed", number(positive,
                                       "m/s, the speed to expect; required where gravity pulls along a periodic "
                                       "axis")),
      }};
}

std::vector<ObjectFormat> all_objects() {
  std::vector<ObjectFormat> all = {scene_object(), fluid_object(), domain_object()};
  all.push_back({"floor", "Plane z = height without wall particles.", {required("height", number(coordinate, "m"))}});
  all.push_back(contact_object());
  all.push_back(container_object());
  for (auto objects : {shape_objects(), motion_objects(), fill_objects()})
    std::move(objects.begin(), objects.end(), std::back_inserter(all));
  all.push_back(time_object());
  return all;
}

}  // namespace

const std::vector<ObjectFormat>& scene_format() {
  static const std::vector<ObjectFormat> all = all_objects();
  return all;
}

const ObjectFormat& object_format(const std::string& name) {
  for (const ObjectFormat& object : scene_format())
    if (object.name == name) return object;
  throw std::logic_error("the scene format has no object " + name);
}

const Member& member_of(const ObjectFormat& object, const std::string& key) {
  for (const Member& member : object.members)
    if (member.key == key) return member;
  throw std::logic_error("the scene format has no key " + object.name + "." + key);
}

}  // namespace decant
