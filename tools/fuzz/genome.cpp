/// \file
/// Numbers drawn, and made into a problem.
#include "tools/fuzz/genome.hpp"

#include "reference/distance.hpp"
#include "reference/error.hpp"
#include "reference/kernel.hpp"
#include "reference/neighbors.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/shapes.hpp"
#include "reference/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

namespace decant::fuzz {
namespace {

constexpr int fine = 64;  // lattice points a dx

/// splitmix64: whole numbers that are the same everywhere, which the library's distributions are not.
/// Source: Steele, Lea & Flood, OOPSLA 2014.
class Dice {
 public:
  /// The first number of one stream begins another, so that seeds in a row have nothing in common.
  explicit Dice(std::uint64_t seed) : state_(seed ^ 0xD6E8FEB86659FD93ull) { state_ = next(); }
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ull;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ z >> 27) * 0x94D049BB133111EBull;
    return z ^ z >> 31;
  }
  /// low … high, both included.
  int whole(int low, int high) {
    return low + static_cast<int>(next() % static_cast<std::uint64_t>(high - low + 1));
  }
  bool in(int hundredths) { return whole(0, 99) < hundredths; }

 private:
  std::uint64_t state_;
};

/// The kinds of states.
enum class Kind { lattice, gas, crowd, coincident, cell_faces, outliers, few };

Kind kind_of(Dice& dice) {
  constexpr std::array<std::pair<Kind, int>, 7> shares = {{{Kind::lattice, 40},
                                                           {Kind::gas, 20},
                                                           {Kind::crowd, 8},
                                                           {Kind::coincident, 8},
                                                           {Kind::cell_faces, 8},
                                                           {Kind::outliers, 8},
                                                           {Kind::few, 8}}};
  int drawn = dice.whole(0, 99);
  for (const auto& [kind, share] : shares)
    if ((drawn -= share) < 0) return kind;
  return Kind::lattice;
}

Point anywhere(Dice& dice, const Genome& g, int fastest) {
  Point p;
  for (std::size_t a = 0; a < 3; ++a) {
    p.x[a] = dice.whole(0, fine * g.size[a] - 1);
    p.v[a] = dice.whole(-fastest, fastest);
  }
  return p;
}

void draw_lattice(Dice& dice, Genome& g, int fastest) {
  const int jitter = dice.in(50) ? 6 : 28, filled = dice.whole(25, 100);
  for (int k = 0; k < g.size[2]; ++k)
    for (int j = 0; j < g.size[1]; ++j)
      for (int i = 0; i < g.size[0]; ++i) {
        if (!dice.in(filled)) continue;
        Point p = anywhere(dice, g, fastest);
        const std::array<int, 3> cell = {i, j, k};
        for (std::size_t a = 0; a < 3; ++a)
          p.x[a] = fine * cell[a] + fine / 2 + dice.whole(-jitter, jitter);
        g.points.push_back(p);
      }
}

/// A period of three supports at least.
void hold_periods(Genome& g) {
  for (std::size_t a = 0; a < 3; ++a)
    if (g.periodic[a]) g.size[a] = std::max(g.size[a], (3 * (16 + g.support) + 9) / 10);
}

void draw_points(Dice& dice, Genome& g) {
  const int fastest = dice.in(10) ? 0 : 128;
  const Kind kind = kind_of(dice);
  const int volume = g.size[0] * g.size[1] * g.size[2];
  const auto scatter = [&](int count) {
    for (int k = 0; k < count; ++k) g.points.push_back(anywhere(dice, g, fastest));
  };
  switch (kind) {
    case Kind::lattice:
      draw_lattice(dice, g, fastest);
      break;
    case Kind::gas:
      scatter(dice.whole(volume / 4, volume));
      break;
    case Kind::crowd: {
      scatter(dice.whole(20, 60));
      const Point middle = anywhere(dice, g, 0);
      for (int k = dice.whole(60, 160); k > 0; --k) {
        Point p = anywhere(dice, g, fastest);
        for (std::size_t a = 0; a < 3; ++a)
          p.x[a] = std::clamp(middle.x[a] + dice.whole(-fine, fine), 0, fine * g.size[a] - 1);
        g.points.push_back(p);
      }
      break;
    }
    case Kind::coincident:
      scatter(dice.whole(20, volume / 2));
      for (int k = dice.whole(1, 6); k > 0; --k) {
        Point twin = g.points[static_cast<std::size_t>(
            dice.whole(0, static_cast<int>(g.points.size()) - 1))];
        twin.v = anywhere(dice, g, fastest).v;
        g.points.push_back(twin);
      }
      break;
    case Kind::cell_faces: {
      // H is a whole number of lattice points for these ratios only.
      g.support = std::array{4, 9, 14}[static_cast<std::size_t>(dice.whole(0, 2))];
      hold_periods(g);
      const int H = fine * (16 + g.support) / 10;
      scatter(dice.whole(volume / 4, volume / 2));
      for (Point& p : g.points)
        for (std::size_t a = 0; a < 3; ++a)
          if (dice.in(40)) p.x[a] = std::min(p.x[a] / H * H, fine * g.size[a] - 1);
      break;
    }
    case Kind::outliers:
      scatter(dice.whole(20, volume / 2));
      for (int k = dice.whole(1, 5); k > 0; --k) {
        Point p = anywhere(dice, g, fastest);
        for (std::size_t a = 0; a < 3; ++a)
          if (!g.periodic[a])
            p.x[a] += (dice.in(50) ? -1 : 1) * fine * dice.whole(12, 1 << dice.whole(4, 10));
        g.points.push_back(p);
      }
      break;
    case Kind::few:
      scatter(dice.whole(0, 3));
      break;
  }
}

bool stands(const Genome& g) { return g.room != Room::open; }
bool is_cup(const Genome& g) { return g.room == Room::cup || g.room == Room::tilting_cup; }

Container container_of(const Genome& g, const Scene& scene, const Vec3& corner) {
  const double dx = scene.particle_spacing;
  const double thick =
      std::max(scene.support_radius(), g.layers * dx) * (1 + 1e-9);
  const Vec3 size = dx * Vec3(g.size[0], g.size[1], g.size[2]);
  Container c;
  c.wall_thickness = thick;
  if (is_cup(g)) {
    c.name = "cup";
    const double radius = 0.5 * std::min(size.x(), size.y());
    c.shape = cup_shape(radius, size.z(), thick);
    c.origin = corner + Vec3(0.5 * size.x(), 0.5 * size.y(), 0);
    if (g.room == Room::tilting_cup)
      c.tilt = Tilt{c.origin, Vec3::UnitY(), {{0.0, 0.0}, {scene.schedule.end, g.turn / 8.0}}};
  } else {
    c.name = "tank";
    OpenFaces open{};
    for (std::size_t a = 0; a < 3; ++a)
      if (g.periodic[a]) open[a] = {true, true};
    BoxShape shape = tank_shape(size, thick, open);
    shape.endless = scene.domain.periodic;
    c.shape = shape;
    c.origin = corner;
  }
  c.surface_velocity = Vec3(g.belt / 8.0, 0, 0);
  return c;
}

}  // namespace

Genome random_genome(std::uint64_t seed) {
  Dice dice(seed);
  Genome g;
  g.kernel = dice.whole(0, 2);
  g.support = dice.whole(2, 12);
  g.linear_state = dice.in(50);
  g.tension = dice.in(50);
  g.viscosity = dice.in(20) ? 0 : dice.whole(1, 50);
  g.wall_viscosity = dice.in(20) ? 0 : dice.whole(1, 100);
  g.restitution = dice.in(50) ? 0 : dice.whole(1, 10);
  g.friction = dice.in(50) ? 0 : dice.whole(1, 10);
  g.contact = dice.whole(0, 5);
  g.scale = dice.whole(-2, 4);
  g.far = dice.in(60) ? 0 : dice.whole(1, 4);
  if (dice.in(50))
    for (int& o : g.offset) o = dice.whole(-3, 3);
  for (int& s : g.size) s = dice.whole(4, 7);
  g.room = static_cast<Room>(std::array{0, 1, 1, 1, 2, 3, 3, 1}[static_cast<std::size_t>(dice.whole(0, 7))]);
  g.layers = dice.whole(1, 3);
  if (!is_cup(g))
    for (int& p : g.periodic) p = dice.in(30);
  hold_periods(g);
  g.floor = g.room != Room::tilting_cup && !g.periodic[2] && dice.in(30);
  if (g.room == Room::tank && g.periodic[0] && g.periodic[1] && g.periodic[2]) g.room = Room::open;
  g.belt = stands(g) && dice.in(20) ? dice.whole(-8, 8) : 0;
  g.turn = g.room == Room::tilting_cup ? dice.whole(-16, 16) : 0;
  g.substep = dice.whole(0, 999);
  g.courant = dice.whole(1, 4);
  draw_points(dice, g);
  return g;
}

Fixture problem_of(const Genome& g, const std::string& name) {
  Fixture f;
  f.name = name;
  f.phase = "fuzz";
  Scene& scene = f.scene;
  scene.name = name;
  const double dx = scene.particle_spacing = std::ldexp(1.0, g.scale - 8);
  scene.kernel = static_cast<KernelFamily>(g.kernel);
  scene.support_ratio = (16 + g.support) / 10.0;
  scene.fluid.eos_exponent = g.linear_state ? 1 : 7;
  scene.fluid.allow_tension = g.tension != 0;
  scene.fluid.viscosity = g.viscosity / 100.0;
  scene.fluid.wall_viscosity = g.wall_viscosity / 100.0;
  scene.contact = {(5 + g.contact) / 20.0, g.restitution / 10.0, g.friction / 10.0};
  scene.wall_layers = g.layers;

  // Powers of two, so that every point of the lattice is one of fp32's.
  const double far = 64 * dx * std::ldexp(1.0, g.far);
  const Vec3 corner = far * Vec3(g.offset[0], g.offset[1], g.offset[2]);
  const Vec3 size = dx * Vec3(g.size[0], g.size[1], g.size[2]);
  scene.domain = {corner, corner + size, {}};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    scene.domain.periodic[a] = g.periodic[a] != 0;
    if (g.periodic[a]) continue;
    double low = 0, high = size[axis];
    for (const Point& p : g.points) {
      low = std::min(low, dx * p.x[a] / fine);
      high = std::max(high, dx * p.x[a] / fine);
    }
    // Room for walls that turn.
    const double margin = 12 * dx + (g.room == Room::tilting_cup ? size.maxCoeff() : 0);
    scene.domain.min[axis] = corner[axis] + low - margin;
    scene.domain.max[axis] = corner[axis] + high + margin;
  }
  scene.schedule.end = 1;
  scene.schedule.frames = 10;
  scene.schedule.courant = g.courant / 10.0;
  scene.schedule.max_speed = 2.5;
  if (stands(g)) scene.containers.push_back(container_of(g, scene, corner));
  if (g.floor)
    scene.floor = Floor{corner.z() + (stands(g) ? -1.01 * scene.containers[0].wall_thickness : 0.5 * dx)};
  // A scene starts with fluid, though this state is another one: as far from all walls as there is room.
  Vec3 at = corner + 0.5 * size;
  for (std::size_t a = 0; a < 3; ++a)
    if (!g.periodic[a]) {
      const auto axis = static_cast<Eigen::Index>(a);
      at[axis] = scene.domain.max[axis] - 2 * dx;
      break;
    }
  Fill fill;
  fill.box = SolidBox{at - Vec3::Constant(dx), at + Vec3::Constant(dx)};
  scene.fills.push_back(fill);
  scene.schedule.substeps_per_frame = substeps_for(scene);

  const auto n = static_cast<Eigen::Index>(g.points.size());
  f.state.substep = g.substep;
  f.state.position.resize(3, n);
  f.state.velocity.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Point& p = g.points[static_cast<std::size_t>(i)];
    f.state.position.col(i) = corner + dx / fine * Vec3(p.x[0], p.x[1], p.x[2]);
    f.state.velocity.col(i) =
        scene.fluid.sound_speed / 512 * Vec3(p.v[0], p.v[1], p.v[2]);
  }
  f.state.quantise();
  return f;
}

Classes classes_of(const Fixture& fixture) {
  const Scene& scene = fixture.scene;
  const auto& x = fixture.state.position;
  const double H = scene.support_radius(), dx = scene.particle_spacing;
  Classes c{};
  const auto set = [&](const char* name) {
    for (std::size_t k = 0; k < class_names.size(); ++k)
      if (std::string(class_names[k]) == name) c[k] = true;
  };
  const Walls walls = sample_walls(scene);
  const double time = scene.time_at(fixture.state.substep);
  Neighbors near;
  find_neighbors(scene, x, pose_walls(scene, walls, time).position, NeighborSearch::cells, near);
  for (const Container& container : scene.containers) {
    set("walls");
    if (container.tilt && container.tilt->keys.back().angle != 0) set("moving wall");
    if (container.surface_velocity.norm() > 0) set("belt");
    const SolidDistance solid(container);
    const Pose pose = pose_at(container, time);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      if (solid.at(pose.to_local(Vec3(x.col(i)))).distance < scene.contact_distance())
        set("contact");
  }
  for (const bool p : scene.domain.periodic)
    if (p) set("periodic");
  if (scene.floor) set("floor");
  if (x.cols() <= 1) set("one or none");
  if (scene.fluid.allow_tension) set("tension");
  std::set<std::tuple<double, double, double>> places;
  // Cells begin where the fluid does.
  const Vec3 lowest = x.cols() > 0 ? Vec3(x.rowwise().minCoeff()) : Vec3::Zero();
  int on_faces = 0;
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

std::string describe(const Genome& g) {
  std::string text = fmt::format(
      "{} particle{}, {}, {}, H = {:.1f} dx", g.points.size(), g.points.size() == 1 ? "" : "s",
      std::array{"no walls", "tank", "cup", "tilting cup"}[static_cast<std::size_t>(g.room)],
      std::array{"cubic_spline", "wendland_c2", "mueller2003"}[static_cast<std::size_t>(g.kernel)],
      (16 + g.support) / 10.0);
  for (std::size_t a = 0; a < 3; ++a)
    if (g.periodic[a]) text += fmt::format(", periodic along {}", "xyz"[a]);
  if (g.offset != std::array<int, 3>{}) text += ", away from the origin";
  return text;
}

}  // namespace decant::fuzz
