/// \file
/// What a case has, for tables and for people.
#include "tools/fuzz/case.hpp"

#include "reference/distance.hpp"
#include "reference/neighbors.hpp"
#include "reference/pose.hpp"
#include "reference/sampling.hpp"
#include "reference/shapes.hpp"
#include "reference/solver.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <tuple>

namespace decant::fuzz {
namespace {

/// An outline with an edge that is neither level nor upright.
bool is_slanted(const Container& container) {
  const auto* revolved = std::get_if<RevolvedShape>(&container.shape);
  if (!revolved) return false;
  for (const ProfileEdge& e : surface_edges(*revolved))
    if (e.r0 != e.r1 && e.z0 != e.z1) return true;
  return false;
}

bool periods_differ(const Domain& domain) {
  std::set<double> periods;
  for (Eigen::Index a = 0; a < 3; ++a)
    if (domain.periodic[static_cast<std::size_t>(a)]) periods.insert(domain.max[a] - domain.min[a]);
  return periods.size() > 1;
}

}  // namespace

Tags tags_of(const Fixture& fixture) {
  const Scene& scene = fixture.scene;
  const auto& x = fixture.state.position;
  const double H = scene.support_radius(), dx = scene.particle_spacing;
  Tags c{};
  const auto set = [&](const char* name) {
    for (std::size_t k = 0; k < tag_names.size(); ++k)
      if (std::string(tag_names[k]) == name) c[k] = true;
  };
  const Walls walls = sample_walls(scene);
  const double time = scene.time_at(fixture.state.substep);
  Neighbors near;
  find_neighbors(scene, x, pose_walls(scene, walls, time).position, NeighborSearch::cells, near);
  const double reach = scene.contact_distance();
  for (const Container& container : scene.containers) {
    set("walls");
    if (container.surface_velocity.norm() > 0) set("belt");
    if (is_slanted(container)) set("slanted outline");
    const SolidDistance solid(container);
    const Pose pose = pose_at(container, time);
    if (pose.angular_velocity.norm() > 0) set("moving wall");
    if (pose.linear_velocity.norm() > 0) set("translating wall");
    if (std::holds_alternative<BoxShape>(container.shape) && !pose.rotation.isIdentity(0)) set("tilted box");
    if (container.tilt && container.tilt->keys.size() >= 3) set("tilt of three keys");
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Vec3 local = pose.to_local(Vec3(x.col(i)));
      if (!solid.may_be_within(reach, local) || !(solid.at(local).distance < reach)) continue;
      set("contact");
      if (scene.floor && x(2, i) - scene.floor->height < dx) set("at wall and floor");
    }
  }
  if (scene.containers.size() > 1) set("several containers");
  if (scene.mass_ratio != 1) set("calibrated mass");
  if (!(scene.gravity.x() == 0 && scene.gravity.y() == 0 && scene.gravity.z() < 0)) set("gravity not down");
  if (periods_differ(scene.domain)) set("periods that differ");
  for (const bool p : scene.domain.periodic)
    if (p) set("periodic");
  if (scene.floor) set("floor");
  if (x.cols() <= 1) set("one or none");
  if (scene.fluid.allow_tension) set("tension");
  std::set<std::tuple<double, double, double>> places;
  // Cells begin where the fluid does.
  const Vec3 lowest = x.cols() > 0 ? Vec3(x.rowwise().minCoeff()) : Vec3::Zero();
  Eigen::Index on_faces = 0;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (near.fluid[k].empty() && near.wall[k].empty()) set("isolated");
    if (near.fluid[k].size() > 80) set("crowded");
    if (!places.insert({x(0, i), x(1, i), x(2, i)}).second) set("coincident");
    if ((x.col(i).array() < 0).any()) set("negative side");
    if (x.col(i).cwiseAbs().maxCoeff() > 500 * dx) set("far away");
    for (int a = 0; a < 3; ++a) {
      const double cells = (x(a, i) - lowest[a]) / H;
      if (cells == std::round(cells)) on_faces += 1;
      const double room = scene.domain.max[a] - scene.domain.min[a];
      if (!scene.domain.periodic[static_cast<std::size_t>(a)] && room > 60 * dx) set("outlier");
    }
  }
  if (4 * on_faces > x.cols()) set("on cell faces");
  return c;
}

std::string describe(const Case& g) {
  std::string text = fmt::format("{} particle{}", g.points.size(), g.points.size() == 1 ? "" : "s");
  if (g.vessels.empty()) text += ", no walls";
  for (const Vessel& v : g.vessels) {
    text += fmt::format(", {}{}{}", v.tilts ? "tilting " : "", v.translates ? "translating " : "",
                        form_names[static_cast<std::size_t>(v.form)]);
    if (v.tilts && v.steps.size() > 1) text += fmt::format(" of {} keys", v.steps.size() + 1);
    if (v.belt != std::array<int, 3>{}) text += " that runs like a belt";
  }
  if (g.reversed) text += ", listed from the last on";
  text += fmt::format(", {}, H = {:.1f} dx", kernel_names[static_cast<std::size_t>(g.kernel)], (16 + g.support) / 10.0);
  if (g.mass) text += fmt::format(", mass ratio {:.2f}", (100 + g.mass) / 100.0);
  if (g.rest_density) text += fmt::format(", rest density {}", 1000 + 100 * g.rest_density);
  if (g.sound_speed) text += fmt::format(", c0 = {} m/s", 10 + g.sound_speed);
  if (g.gravity == std::array<int, 3>{}) text += ", no gravity";
  else if (g.gravity != Case{}.gravity)
    text += fmt::format(", gravity ({:.2f}, {:.2f}, {:.2f})", g.gravity[0] / 100.0, g.gravity[1] / 100.0,
                        g.gravity[2] / 100.0);
  if (g.floor) text += ", a floor";
  if (g.contact) text += fmt::format(", contact at {:.2f} dx", (5 + g.contact) / 20.0);
  for (std::size_t a = 0; a < 3; ++a)
    if (g.periodic[a]) text += fmt::format(", periodic along {}", "xyz"[a]);
  if (g.offset != std::array<int, 3>{}) text += ", away from the origin";
  return text;
}

}  // namespace decant::fuzz
