/// \file
/// Numbers made into a scene and a state. Containers are placed by planes that keep them H apart, and the
/// domain reaches as far as they ever do.
#include "tools/fuzz/case.hpp"

#include "reference/pose.hpp"
#include "reference/scene_checks.hpp"
#include "reference/shapes.hpp"
#include "reference/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace decant::fuzz {
namespace {

Vec3 real(const std::array<int, 3>& whole) { return {double(whole[0]), double(whole[1]), double(whole[2])}; }

/// Bowl: a cone closed by a bottom.
RevolvedShape bowl_shape(double radius, double height, double thick) {
  const double foot = 0.5 * radius;
  // Across a slanted wall the thickness is less than along r.
  const double wide = thick * std::hypot(1.0, (radius - foot) / height);
  return {{{0, -thick}, {foot + wide, -thick}, {radius + wide, height}, {radius, height}, {foot, 0}, {0, 0}}};
}

/// Hourglass: a ring whose hole is narrow halfway up.
RevolvedShape hourglass_shape(double radius, double height, double thick) {
  const double outer = radius + thick * std::hypot(1.0, 0.75 * radius / (0.5 * height));
  return {{{0.75 * radius, 0}, {outer, 0}, {outer, height}, {radius, height}, {0.4 * radius, 0.5 * height}}};
}

/// Plug: a cylinder with a chamfer, solid throughout.
RevolvedShape plug_shape(double radius, double height) {
  return {{{0, 0}, {radius, 0}, {radius, 0.5 * height}, {0.5 * radius, height}, {0, height}}};
}

BoxShape box_form(Form form, const Vec3& size, double thick, const std::array<bool, 3>& periodic) {
  OpenFaces open{};
  open[2][1] = form == Form::open_tank;
  if (form == Form::steps) open[0][1] = open[1][0] = open[2][1] = true;
  for (std::size_t a = 0; a < 3; ++a)
    if (periodic[a]) open[a] = {true, true};
  BoxShape shape = tank_shape(size, thick, open);
  if (form == Form::steps) {  // a block in the corner, over floor and walls
    SolidBox block{Vec3::Constant(-thick), Vec3::Constant(thick)};
    block.max.z() = std::max(thick, 0.5 * size.z());
    for (Eigen::Index a = 0; a < 3; ++a)
      if (periodic[static_cast<std::size_t>(a)]) {
        block.min[a] = 0;
        block.max[a] = size[a];
      }
    shape.solid.push_back(block);
  }
  shape.endless = periodic;
  return shape;
}

/// The way from the container's origin to the middle of its room, container frame, m.
Vec3 middle_of(const Vessel& v, double dx) {
  Vec3 middle = 0.5 * dx * real(v.size);
  if (is_revolved(v.form)) middle.x() = middle.y() = 0;
  return middle;
}

/// \param fastest  rad/s or m/s, its derivative's amplitude
template <class Value>
Oscillation<Value> oscillation_of(const Oscillating& o, const Value& fastest, double dt) {
  const double period = o.period * dt;
  return {period / (2 * std::numbers::pi) * fastest, 1 / period, o.phase / 8.0};
}

Translation translation_of(const Case& g, const Vessel& v, double sound_speed, double dt) {
  Translation t;
  int substep = std::max(0, g.substep + v.translation_start);
  Vec3 offset = Vec3::Zero();
  t.keys.clear();
  t.keys.push_back({substep * dt, offset});
  for (const TranslationStep& step : v.translation_steps) {
    substep += step.substeps;
    offset += sound_speed / 256 * step.substeps * dt / 1.5 * real(step.speed);
    t.keys.push_back({substep * dt, offset});
  }
  t.velocity = sound_speed / 256 * real(v.velocity);
  if (v.translation_oscillation.any())
    t.oscillation =
        oscillation_of<Vec3>(v.translation_oscillation, sound_speed / 256 * real(v.translation_oscillation.speed), dt);
  return t;
}

/// A container whose room has its middle in `middle` at the state's time, upright or turned.
Container container_of(const Case& g, const Vessel& v, std::size_t k, const Scene& scene, const Vec3& middle) {
  const double dx = scene.particle_spacing;
  const Vec3 size = dx * real(v.size);
  Container c;
  c.name = fmt::format("{}-{}", form_names[static_cast<std::size_t>(v.form)], k);
  std::replace(c.name.begin(), c.name.end(), ' ', '-');
  const double thick = c.wall_thickness = std::max(scene.support_radius(), g.layers * dx) * (1 + 1e-9);
  const double radius = 0.5 * std::min(size.x(), size.y());
  switch (v.form) {
    case Form::cup:
      c.shape = cup_shape(radius, size.z(), thick);
      break;
    case Form::bowl:
      c.shape = bowl_shape(radius, size.z(), thick);
      break;
    case Form::hourglass:
      c.shape = hourglass_shape(radius, size.z(), thick);
      break;
    case Form::plug:
      c.shape = plug_shape(std::max(radius, thick), std::max(size.z(), thick));
      break;
    default:
      c.shape = box_form(v.form, size, thick, scene.domain.periodic);
  }
  c.surface_velocity = scene.fluid.sound_speed / 64 * real(v.belt);
  const Vec3 local_middle = middle_of(v, dx);
  c.origin = middle - local_middle;
  const double dt = scene.time_step(), now = scene.time_at(g.substep);
  // Before it translates it stands where it comes to the middle at the state's time.
  Vec3 start = middle;
  if (v.translates) {
    c.translation = translation_of(g, v, scene.fluid.sound_speed, dt);
    start -= translation_at(*c.translation, now).offset;
    c.origin = start - local_middle;
  }
  if (!v.tilts) return c;
  double farthest = 0;
  for (const Ring& ring : solid_rings(c))
    farthest = std::max(farthest, (ring.center - local_middle).norm() + ring.radius);
  const Vec3 pivot = dx * real(v.pivot);
  farthest += pivot.norm();
  const double unit = scene.fluid.sound_speed / 256 / farthest;  // rad/s
  Tilt tilt{start + pivot, real(v.axis).normalized(), {}};
  int substep = std::max(0, g.substep + v.start);
  double angle = v.angle / 8.0;
  tilt.keys.push_back({substep * dt, angle});
  for (const TiltStep& step : v.steps) {
    substep += step.substeps;
    // A smoothstep is one and a half times as fast in its middle as on average.
    angle += step.speed * unit * step.substeps * dt / 1.5;
    tilt.keys.push_back({substep * dt, angle});
  }
  tilt.rate = v.rate * unit;
  if (v.tilt_oscillation.any())
    tilt.oscillation = oscillation_of<double>(v.tilt_oscillation, v.tilt_oscillation.speed[0] * unit, dt);
  const Eigen::AngleAxisd turned(tilt_at(tilt, now).angle, tilt.axis);
  c.origin = tilt.pivot + turned.inverse() * (start - turned * local_middle - tilt.pivot);
  c.tilt = tilt;
  return c;
}

double reach(const Container& c, const Scene& scene, const Vec3& direction) {
  return farthest_along(direction, solid_rings(c), &c, scene.schedule.end);
}

/// Middles of the containers' rooms at the state's time, m; puts the containers into the scene.
std::vector<Vec3> place_containers(const Case& g, Scene& scene, const Vec3& corner) {
  const double dx = scene.particle_spacing;
  std::vector<Vec3> middles;
  for (std::size_t k = 0; k < g.vessels.size(); ++k) {
    const Vessel& v = g.vessels[k];
    Vec3 middle = corner + 0.5 * dx * real(g.room());
    if (k > 0) {
      const Eigen::Index a = v.side / 2, b = (a + 1) % 3, d = (a + 2) % 3;
      middle[b] += dx * v.shift[0];
      middle[d] += dx * v.shift[1];
      const Vec3 away = (v.side % 2 ? 1.0 : -1.0) * Vec3::Unit(a);
      double beyond = -std::numeric_limits<double>::infinity();
      for (const Container& c : scene.containers) beyond = std::max(beyond, reach(c, scene, away));
      const double back = reach(container_of(g, v, k, scene, middle), scene, -away);
      const double move = beyond + back + scene.support_radius() + dx / 16 * v.gap;
      // To a point of the lattice of coordinates that fp32 has.
      middle += std::ceil(move / dx * fine) * dx / fine * away;
    }
    scene.containers.push_back(container_of(g, v, k, scene, middle));
    middles.push_back(middle);
  }
  return middles;
}

/// As far as containers, pivots and particles get, and some room.
void make_domain(const Case& g, Scene& scene, const Vec3& corner, const Eigen::Matrix3Xd& x) {
  const double dx = scene.particle_spacing, H = scene.support_radius();
  const Vec3 size = dx * real(g.room());
  // Boxes end where the period does, solids of revolution stand within it.
  const bool turned = !g.vessels.empty() && is_revolved(g.vessels[0].form);
  for (Eigen::Index a = 0; a < 3; ++a) {
    double low = corner[a], high = corner[a] + size[a], margin = 0;
    const bool repeats = g.periodic[static_cast<std::size_t>(a)] != 0;
    if (!repeats || turned) {
      for (const Container& c : scene.containers) {
        low = std::min(low, -reach(c, scene, -Vec3::Unit(a)));
        high = std::max(high, reach(c, scene, Vec3::Unit(a)));
        if (!c.tilt) continue;
        low = std::min(low, c.tilt->pivot[a]);
        high = std::max(high, c.tilt->pivot[a]);
      }
      if (x.cols() > 0) {
        low = std::min(low, x.row(a).minCoeff());
        high = std::max(high, x.row(a).maxCoeff());
      }
      margin = repeats ? 1.001 * H : 6 * dx;
    }
    scene.domain.min[a] = low - margin;
    scene.domain.max[a] = high + margin;
  }
}

/// A scene starts with fluid, though this state is another one: as far from all walls as there is room.
Fill fill_of(const Scene& scene, const Vec3& middle) {
  const double dx = scene.particle_spacing;
  Vec3 at = middle;
  bool aside = false;
  for (Eigen::Index a = 0; a < 3; ++a) {
    if (scene.domain.periodic[static_cast<std::size_t>(a)]) at[a] = scene.domain.min[a] + dx;
    else if (!aside) {
      at[a] = scene.domain.max[a] - 2 * dx;
      aside = true;
    }
  }
  Fill fill;
  fill.box = SolidBox{at - Vec3::Constant(dx), at + Vec3::Constant(dx)};
  return fill;
}

}  // namespace

Fixture fixture_of(const Case& g, const std::string& name) {
  Fixture f;
  f.name = name;
  f.phase = "fuzz";
  Scene& scene = f.scene;
  scene.name = name;
  const double dx = scene.particle_spacing = std::ldexp(1.0, g.scale - 8);
  scene.kernel = static_cast<KernelFamily>(g.kernel);
  scene.support_ratio = (16 + g.support) / 10.0;
  scene.mass_ratio = (100 + g.mass) / 100.0;
  scene.fluid.rest_density = 1000 + 100.0 * g.rest_density;
  scene.fluid.sound_speed = 10 + g.sound_speed;
  scene.fluid.eos_exponent = g.linear_state ? 1 : 7;
  scene.fluid.allow_tension = g.tension != 0;
  scene.fluid.viscosity = g.viscosity / 100.0;
  scene.fluid.wall_viscosity = g.wall_viscosity / 100.0;
  scene.gravity = real(g.gravity) / 100.0;
  scene.contact = {(5 + g.contact) / 20.0, g.restitution / 10.0, g.friction / 10.0};
  scene.wall_layers = g.layers;
  for (std::size_t a = 0; a < 3; ++a) scene.domain.periodic[a] = g.periodic[a] != 0;
  // A little longer than the state is late, so that nothing is done after the end, nor goes on for long.
  scene.schedule.frames = g.frames;
  scene.schedule.courant = g.courant / 10.0;
  scene.schedule.max_speed = 0.25 * scene.fluid.sound_speed;
  scene.schedule.end = (g.substep + 50) * longest_time_step(scene, scene.schedule.courant, *scene.schedule.max_speed);
  scene.schedule.substeps_per_frame = substeps_for(scene);

  // Powers of two, so that every point of the lattice is one of fp32's.
  const double far = 64 * dx * std::ldexp(1.0, g.far);
  const Vec3 corner = far * real(g.offset);
  const std::vector<Vec3> middles = place_containers(g, scene, corner);

  const auto n = static_cast<Eigen::Index>(g.points.size());
  f.state.substep = g.substep;
  f.state.position.resize(3, n);
  f.state.velocity.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Point& p = g.points[static_cast<std::size_t>(i)];
    Vec3 from = corner;
    if (const auto k = static_cast<std::size_t>(p.room); k > 0 && k < middles.size())
      from = middles[k] - 0.5 * dx * real(g.vessels[k].size);
    f.state.position.col(i) = from + dx / fine * real(p.x);
    f.state.velocity.col(i) = scene.fluid.sound_speed / 512 * real(p.v);
  }
  f.state.quantise();

  if (g.floor) {
    double height = corner.z() + 0.5 * dx;
    if (!scene.containers.empty()) {
      double lowest = std::numeric_limits<double>::infinity();
      for (const Container& c : scene.containers) lowest = std::min(lowest, -reach(c, scene, -Vec3::UnitZ()));
      height = lowest - dx / 16 * g.floor_gap;
    }
    scene.floor = Floor{height};
  }
  make_domain(g, scene, corner, f.state.position);
  if (scene.floor) scene.domain.min.z() = std::min(scene.domain.min.z(), scene.floor->height - 6 * dx);
  scene.fills.push_back(fill_of(scene, corner + 0.5 * dx * real(g.room())));
  if (g.reversed) std::reverse(scene.containers.begin(), scene.containers.end());
  return f;
}

}  // namespace decant::fuzz
