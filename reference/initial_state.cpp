/// \file
/// Where the fluid's particles start.
#include "reference/initial_state.hpp"

#include "reference/distance.hpp"
#include "reference/pose.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace decant {
namespace {

struct Lattice {
  Vec3 first;               // m, the first particle
  std::array<int, 3> size;  // particles an axis
};

/// Lattice that starts dx/2 inside the box; a remainder narrower than dx stays empty.
Lattice lattice_in(const SolidBox& box, double dx) {
  Lattice lattice;
  lattice.first = box.min.array() + 0.5 * dx;
  for (int a = 0; a < 3; ++a) lattice.size[a] = static_cast<int>(std::floor((box.max[a] - box.min[a]) / dx + 1e-6));
  return lattice;
}

/// Lattice evenly about the center; along a rod as in a box, so that it goes on across a period.
Lattice lattice_in(const RoundShape& shape, double dx) {
  Lattice lattice = lattice_in(shape.bounds(), dx);
  const int half = static_cast<int>(std::ceil(shape.radius / dx));
  for (int a = 0; a < 3; ++a) {
    if (a == shape.axis) continue;
    lattice.first[a] = shape.center[a] - (half - 0.5) * dx;
    lattice.size[static_cast<std::size_t>(a)] = 2 * half;
  }
  return lattice;
}

bool holds(const RoundShape& shape, const Vec3& x, double dx) {
  Vec3 away = x - shape.center;
  if (shape.axis >= 0) away[shape.axis] = 0;
  return away.norm() <= shape.radius - 0.5 * dx * (1 - 1e-6);
}

/// Lattice about the axis of a revolved cavity, from its bottom up to the level.
Lattice lattice_in(const RevolvedShape& shape, double level, double dx) {
  double widest = 0, bottom = INFINITY;
  for (const auto& p : shape.profile) {
    widest = std::max(widest, p[0]);
    if (p[0] == 0.0 && (bottom == INFINITY || p[1] > bottom)) bottom = p[1];
  }
  if (bottom == INFINITY) throw std::runtime_error("a level needs a cup that is closed on its axis");
  const int half = static_cast<int>(std::ceil(widest / dx));
  return {Vec3(-(half - 0.5) * dx, -(half - 0.5) * dx, bottom + 0.5 * dx),
          {2 * half, 2 * half, static_cast<int>(std::floor(level / dx + 1e-6))}};
}

/// The containers that a fill goes around, as they stand at the start.
class Immersed {
 public:
  Immersed(const Scene& scene, const Fill& fill) {
    for (const auto& c : scene.containers)
      if (std::find(fill.around.begin(), fill.around.end(), c.name) != fill.around.end())
        bodies_.push_back({SolidDistance(c), pose_at(c, 0.0)});
  }
  /// Whether all their solids are `least` (m) away from a point of the world, or farther.
  bool leave_room(const Vec3& world, double least) const {
    return std::all_of(bodies_.begin(), bodies_.end(), [&](const Body& body) {
      const Vec3 local = body.pose.to_local(world);
      return !body.solid.may_be_within(least, local) || body.solid.at(local).distance >= least;
    });
  }

 private:
  struct Body {
    SolidDistance solid;
    Pose pose;
  };
  std::vector<Body> bodies_;
};

}  // namespace

ParticleState initial_state(const Scene& scene) {
  const double dx = scene.particle_spacing;
  std::vector<Vec3> position, velocity;
  for (const Fill& fill : scene.fills) {
    const Container* container = nullptr;
    for (const auto& c : scene.containers)
      if (c.name == fill.container) container = &c;
    Lattice lattice;
    if (fill.round) {
      lattice = lattice_in(*fill.round, dx);
    } else if (fill.box) {
      lattice = lattice_in(*fill.box, dx);
    } else if (const auto* revolved = std::get_if<RevolvedShape>(&container->shape)) {
      lattice = lattice_in(*revolved, fill.level, dx);
    } else {
      SolidBox box = std::get<BoxShape>(container->shape).cavity;
      box.max.z() = box.min.z() + fill.level;
      lattice = lattice_in(box, dx);
    }
    const auto solid = container ? std::optional<SolidDistance>(*container) : std::nullopt;
    const Pose pose = container ? pose_at(*container, 0.0) : Pose{};
    const Immersed immersed(scene, fill);
    const std::size_t before = position.size();
    for (int k = 0; k < lattice.size[2]; ++k)
      for (int j = 0; j < lattice.size[1]; ++j)
        for (int i = 0; i < lattice.size[0]; ++i) {
          const Vec3 x = lattice.first + dx * Vec3(i, j, k);
          if (fill.round && !holds(*fill.round, x, dx)) continue;
          if (solid && (!solid->in_cavity(x) || solid->at(x).distance < 0.5 * dx * (1 - 1e-6))) continue;
          if (!immersed.leave_room(pose.to_world(x), 0.5 * dx * (1 - 1e-6))) continue;
          position.push_back(pose.to_world(x));
          velocity.push_back(fill.velocity_at(position.back()));
        }
    if (position.size() == before)
      throw std::runtime_error("fill " + std::to_string(&fill - scene.fills.data()) +
                               " holds no particle at this spacing");
  }
  ParticleState state;
  const auto n = static_cast<Eigen::Index>(position.size());
  state.position.resize(3, n);
  state.velocity.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    state.position.col(i) = position[static_cast<std::size_t>(i)];
    state.velocity.col(i) = velocity[static_cast<std::size_t>(i)];
  }
  state.quantise();
  return state;
}

}  // namespace decant
