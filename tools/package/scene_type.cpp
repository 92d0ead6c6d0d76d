/// \file
/// Attributes are those of decant_scene (oracle/plugin.h).
#include "tools/package/scene_type.hpp"

#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_file.hpp"
#include "tools/package/arrays.hpp"

#include <nanobind/stl/string.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace decant::package {
namespace {

constexpr std::array kernels = {"cubic_spline", "wendland_c2", "mueller2003"};

nb::tuple triple(const double* v) { return nb::make_tuple(v[0], v[1], v[2]); }

/// Throws IndexError.
void require_container(const SceneType& scene, int k) {
  if (k < 0 || k >= scene.flat.containers)
    throw nb::index_error(("container " + std::to_string(k) + " of " + std::to_string(scene.flat.containers)).c_str());
}

nb::dict pose(const SceneType& scene, int k, double time) {
  require_container(scene, k);
  decant_pose p;
  scene.flat.pose(scene.flat.host, k, time, &p);
  nb::dict out;
  out["rotation"] = numpy_copy(p.rotation, {3, 3});
  out["translation"] = numpy_copy(p.translation, {3});
  out["pivot"] = numpy_copy(p.pivot, {3});
  out["angular_velocity"] = numpy_copy(p.angular_velocity, {3});
  out["linear_velocity"] = numpy_copy(p.linear_velocity, {3});
  out["surface_velocity"] = numpy_copy(p.surface_velocity, {3});
  return out;
}

nb::tuple distance(const SceneType& scene, int k, const Vectors& points) {
  require_container(scene, k);
  const std::size_t n = points.shape(0);
  std::vector<double> distances(n), normals(3 * n);
  for (std::size_t i = 0; i < n; ++i)
    distances[i] = scene.flat.distance(scene.flat.host, k, points.data() + 3 * i, normals.data() + 3 * i);
  return nb::make_tuple(numpy_copy(distances.data(), {n}), numpy_copy(normals.data(), {n, 3}));
}

nb::tuple walls(const SceneType& scene) {
  const Walls sampled = sample_walls(scene.of_file());
  Eigen::Matrix3Xd position(3, sampled.size());
  std::vector<std::int32_t> container;
  for (std::size_t k = 0; k < sampled.containers.size(); ++k) {
    const auto& particles = sampled.containers[k].position;
    position.middleCols(static_cast<Eigen::Index>(container.size()), particles.cols()) = particles;
    container.resize(container.size() + static_cast<std::size_t>(particles.cols()), static_cast<std::int32_t>(k));
  }
  return nb::make_tuple(to_numpy(position), numpy_copy(container.data(), {container.size()}));
}

nb::tuple start(const SceneType& scene) {
  const ParticleState state = initial_state(scene.of_file());
  return nb::make_tuple(to_numpy(state.position), to_numpy(state.velocity), state.substep);
}

}  // namespace

SceneType SceneType::of(Scene scene) {
  SceneType out;
  out.flat = flat_scene(scene);
  out.callbacks = std::make_unique<SceneCallbacks>(scene.containers);
  out.callbacks->attach(out.flat);
  out.whole = std::move(scene);
  return out;
}

const Scene& SceneType::of_file() const {
  if (!whole) throw nb::value_error("this scene is not of a file: its walls and state came with it");
  return *whole;
}

void bind_scene(nb::module_& module) {
  nb::class_<SceneType> type(module, "Scene",
                             "Everything that changes the answer, SI units. From a file: Scene.load, Scene.parse.");
  type.def_static(
          "load", [](const std::string& path) { return SceneType::of(load_scene(path)); }, nb::arg("path"),
          "A scene file (JSON with comments). Raises InputError with file, key, value and bound.")
      .def_static(
          "parse",
          [](const std::string& text, const std::string& name) { return SceneType::of(complete_scene(text, name)); },
          nb::arg("text"), nb::arg("name") = "scene.json", "The same from text; name is for messages.")
      .def(
          "to_json", [](const SceneType& s) { return scene_to_json(s.of_file()); }, "Every value explicit.")
      .def("_walls", walls)
      .def("_initial_state", start)
      .def("_pose", pose, nb::arg("container"), nb::arg("time"))
      .def("distance", distance, nb::arg("container"), nb::arg("points"),
           "Signed distance [n], m, positive outside the solid, and unit outward normal [n,3] at points [n,3], m, in\n"
           "the frame of a container.")
      .def_prop_ro(
          "kernel", [](const SceneType& s) { return kernels.at(static_cast<std::size_t>(s.flat.kernel)); },
          "cubic_spline, wendland_c2 or mueller2003")
      .def_prop_ro(
          "periodic",
          [](const SceneType& s) {
            return nb::make_tuple(s.flat.periodic[0] != 0, s.flat.periodic[1] != 0, s.flat.periodic[2] != 0);
          },
          "by axis")
      .def_prop_ro(
          "allow_tension", [](const SceneType& s) { return s.flat.allow_tension != 0; }, "False: p = max(p, 0)")
      .def_prop_ro(
          "floor_height",
          [](const SceneType& s) { return s.flat.has_floor ? nb::cast(s.flat.floor_height) : nb::object(nb::none()); },
          "m; None: there is no floor")
      .def_prop_ro(
          "containers", [](const SceneType& s) { return s.flat.containers; }, "how many")
      .def_prop_ro(
          "gravity", [](const SceneType& s) { return triple(s.flat.gravity); }, "m/s^2")
      .def_prop_ro(
          "domain_min", [](const SceneType& s) { return triple(s.flat.domain_min); }, "m")
      .def_prop_ro("domain_max", [](const SceneType& s) { return triple(s.flat.domain_max); }, "m");
  struct Real {
    const char* name;
    double decant_scene::* member;
    const char* what;
  };
  for (const Real& real : {
           Real{"particle_spacing", &decant_scene::particle_spacing, "dx, m"},
           Real{"support_radius", &decant_scene::support_radius, "H, m: where kernels end"},
           Real{"particle_mass", &decant_scene::particle_mass, "m, kg, of each fluid particle"},
           Real{"rest_density", &decant_scene::rest_density, "rho0, kg/m^3"},
           Real{"sound_speed", &decant_scene::sound_speed, "c0, m/s"},
           Real{"eos_exponent", &decant_scene::eos_exponent, "gamma"},
           Real{"eos_stiffness", &decant_scene::eos_stiffness, "B = rho0 c0^2 / gamma, Pa"},
           Real{"viscosity", &decant_scene::viscosity, "mu, Pa s"},
           Real{"wall_viscosity", &decant_scene::wall_viscosity, "mu_w, Pa s"},
           Real{"contact_distance", &decant_scene::contact_distance, "from a solid, m"},
           Real{"restitution", &decant_scene::restitution, "of contact"},
           Real{"friction", &decant_scene::friction, "of contact"},
           Real{"time_step", &decant_scene::time_step, "dt, s; time is substep * dt, never summed up"},
       })
    type.def_prop_ro(real.name, [member = real.member](const SceneType& s) { return s.flat.*member; }, real.what);
}

}  // namespace decant::package
