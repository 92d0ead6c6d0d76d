/// \file
/// The inputs file, dataset by dataset.
#include "oracle/files/port_inputs.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "reference/pose.hpp"
#include "reference/scene_file.hpp"
#include "reference/solver.hpp"

namespace decant {
namespace {

void write_scene(Hdf5Writer& out, const Scene& scene) {
  out.text("/scene/json", scene_to_json(scene), "all of the scene as canonical JSON");
  const auto real = [&](const char* name, double value) { out.attribute("/scene", name, value); };
  out.attribute("/scene", "kernel", to_string(scene.kernel));
  real("particle_spacing", scene.particle_spacing);
  real("support_radius", scene.support_radius());
  real("particle_mass", scene.particle_mass());
  real("rest_density", scene.fluid.rest_density);
  real("sound_speed", scene.fluid.sound_speed);
  real("eos_exponent", scene.fluid.eos_exponent);
  real("eos_stiffness", scene.eos_stiffness());
  out.attribute("/scene", "allow_tension", scene.fluid.allow_tension ? 1 : 0);
  real("viscosity", scene.fluid.viscosity);
  real("wall_viscosity", scene.fluid.wall_viscosity);
  real("time_step", scene.time_step());
  out.vector("/scene/gravity", scene.gravity, "m/s^2", "or any constant body force");
  out.vector("/scene/domain_min", scene.domain.min, "m");
  out.vector("/scene/domain_max", scene.domain.max, "m");
  IdVector periodic(3);
  for (int a = 0; a < 3; ++a) periodic[a] = scene.domain.periodic[static_cast<std::size_t>(a)];
  out.integers("/scene/periodic", periodic, "1 where the axis wraps");
}

void write_walls(Hdf5Writer& out, const Scene& scene, const Walls& walls, double time) {
  const PosedWalls posed = pose_walls(scene, walls, time);
  Eigen::Matrix3Xd local(3, walls.size());
  IdVector container(walls.size());
  Eigen::Index b = 0;
  for (std::size_t c = 0; c < walls.containers.size(); ++c) {
    const auto& x = walls.containers[c].position;
    local.middleCols(b, x.cols()) = x;
    container.segment(b, x.cols()).setConstant(static_cast<std::int64_t>(c));
    b += x.cols();
  }
  out.matrix3("/walls/position", posed.position, "m", "in the world, at the state's time");
  out.matrix3("/walls/velocity", posed.velocity, "m/s", "in the world, at the state's time");
  out.matrix3("/walls/local_position", local, "m", "in the container's frame", Storage::fp32);
  out.integers("/walls/container", container, "index in the scene's order");
}

/// Where each container's frame is at a time (s), and how it moves.
void write_poses(Hdf5Writer& out, const std::string& group, const Scene& scene, double time) {
  const auto n = static_cast<Eigen::Index>(scene.containers.size());
  Eigen::Matrix3Xd axes[3], translation(3, n), pivot(3, n), spin(3, n), belt(3, n), linear(3, n);
  for (auto& axis : axes) axis.resize(3, n);
  for (Eigen::Index c = 0; c < n; ++c) {
    const Pose pose = pose_at(scene.containers[static_cast<std::size_t>(c)], time);
    for (int a = 0; a < 3; ++a) axes[a].col(c) = pose.rotation.col(a);
    translation.col(c) = pose.translation;
    pivot.col(c) = pose.pivot;
    spin.col(c) = pose.angular_velocity;
    belt.col(c) = pose.surface_velocity;
    linear.col(c) = pose.linear_velocity;
  }
  out.attribute(group, "time", time);
  const char* names[3] = {"/x_axis", "/y_axis", "/z_axis"};
  for (int a = 0; a < 3; ++a) out.matrix3(group + names[a], axes[a], "1", "the frame's axis, in the world");
  out.matrix3(group + "/translation", translation, "m", "the frame's origin, in the world");
  out.matrix3(group + "/pivot", pivot, "m", "in the world");
  out.matrix3(group + "/angular_velocity", spin, "rad/s", "about the pivot");
  out.matrix3(group + "/linear_velocity", linear, "m/s", "of the pivot");
  out.matrix3(group + "/surface_velocity", belt, "m/s", "of the surface over its place, in the world");
}

}  // namespace

void write_port_inputs(const std::filesystem::path& file, const Fixture& fixture, const PreparedReference& oracle) {
  const Scene& scene = fixture.scene;
  const ParticleState& state = fixture.state;
  Hdf5Writer out(file);
  out.attribute("/", "decant_inputs", inputs_schema);
  out.attribute("/", "fixture", fixture.name);
  out.attribute("/", "fixture_sha256", fixture.sha256);
  write_scene(out, scene);
  out.attribute("/state", "substep", state.substep);
  out.attribute("/state", "time", scene.time_at(state.substep));
  out.matrix3("/state/position", state.position, "m", "by particle", Storage::fp32);
  out.matrix3("/state/velocity", state.velocity, "m/s", "by particle", Storage::fp32);
  write_walls(out, scene, oracle.walls, scene.time_at(state.substep));
  write_poses(out, "/pose", scene, scene.time_at(state.substep));
  write_poses(out, "/pose_after", scene, scene.time_at(state.substep + 1));
  out.vector("/staged/density", oracle.inputs.density, "kg/m^3",
             "the oracle's, rounded: input of the staged accelerations", Storage::fp32);
  out.vector("/staged/pressure", oracle.inputs.pressure, "Pa",
             "the oracle's, rounded: input of the staged accelerations", Storage::fp32);
  out.commit();
}

}  // namespace decant
