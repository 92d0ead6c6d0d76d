/// \file
/// Fills are judged twice: as levels and boxes against cavity, floor and domain, which does not
/// depend on the spacing; then as the particles they become, against walls and each other, which
/// holds for every shape and tilt.
#include "reference/fluid_checks.hpp"

#include "reference/distance.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/pose.hpp"
#include "reference/scene_json_reader.hpp"
#include "reference/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace decant {
namespace {

bool overlap(const SolidBox& a, const SolidBox& b, double tolerance) {
  return (a.min.array() < b.max.array() - tolerance).all() && (b.min.array() < a.max.array() - tolerance).all();
}

std::string box_text(const SolidBox& box) {
  std::string text;
  for (int a = 0; a < 3; ++a)
    text += (a ? ", " : "") + std::string(1, "xyz"[a]) + " " + to_text(rounded(box.min[a])) + " to " +
            to_text(rounded(box.max[a]));
  return text;
}

class FluidChecks {
 public:
  FluidChecks(const Scene& scene, const std::string& file)
      : scene_(scene), file_(file), tolerance_(1e-6 * scene.particle_spacing) {}

  void run() const {
    if (scene_.fills.empty()) throw InputError(file_, "fill", "[]", "at least one fill");
    std::vector<Eigen::Matrix3Xd> particles;
    for (std::size_t i = 0; i < scene_.fills.size(); ++i) {
      const Fill& fill = scene_.fills[i];
      const std::string key = "fill[" + std::to_string(i) + "]";
      const Container* container = nullptr;
      for (const auto& c : scene_.containers)
        if (c.name == fill.container) container = &c;
      if (!fill.container.empty() && !container)
        throw InputError(file_, key + ".container", fill.container, "the name of a container");
      if (fill.box && container) box_in_container(*fill.box, *container, key + ".box");
      else if (fill.box) free_box(fill, key + ".box");
      else if (container) level(fill.level, *container, key + ".level");
      else throw InputError(file_, key, "neither container nor box", "one of them");
      goes_around(fill, key);
      particles.push_back(particles_of(fill, key));
      stays_in_domain(particles.back(), key);
      clear_of_walls(particles.back(), container, key);
    }
    apart(particles);
  }

 private:
  void level(double level, const Container& container, const std::string& key) const {
    double height;
    if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
      if (!closed_on_axis(*revolved))
        throw InputError(file_, key, to_text(level), "a box instead: " + container.name + " is open on its axis");
      height = rim_height(*revolved) - cavity_bottom(*revolved);
    } else {
      const SolidBox& cavity = std::get<BoxShape>(container.shape).cavity;
      height = cavity.max.z() - cavity.min.z();
    }
    if (!(level > 0 && level <= height + tolerance_))
      throw InputError(file_, key, to_text(level),
                       "> 0 and <= " + to_text(rounded(height)) + ", the inner height of " + container.name);
  }

  void box_in_container(const SolidBox& box, const Container& container, const std::string& key) const {
    if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
      const double radius = box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs()).head<2>().norm();
      const double bottom = cavity_bottom(*revolved), rim = rim_height(*revolved);
      const double room = cavity_radius(*revolved, box.min.z() + tolerance_, box.max.z() - tolerance_).least;
      if (!(box.min.z() >= bottom - tolerance_ && box.max.z() <= rim + tolerance_))
        throw InputError(file_, key, box_text(box),
                         "z from " + to_text(rounded(bottom)) + " to " + to_text(rounded(rim)) + ", the cavity of " +
                             container.name);
      if (!(std::isfinite(room) && radius <= room + tolerance_))
        throw InputError(file_, key, box_text(box) + " (corners at r = " + to_text(rounded(radius)) + ")",
                         "corners within the cavity of " + container.name +
                             ", r <= " + to_text(rounded(std::isfinite(room) ? room : 0.0)));
      return;
    }
    const auto& shape = std::get<BoxShape>(container.shape);
    if (!((box.min.array() >= shape.cavity.min.array() - tolerance_).all() &&
          (box.max.array() <= shape.cavity.max.array() + tolerance_).all()))
      throw InputError(file_, key, box_text(box),
                       "within the cavity of " + container.name + ", " + box_text(shape.cavity));
    clear_of_boxes(box, shape, container.name, key);
  }

  void free_box(const Fill& fill, const std::string& key) const {
    const SolidBox& box = *fill.box;
    if (!((box.min.array() >= scene_.domain.min.array() - tolerance_).all() &&
          (box.max.array() <= scene_.domain.max.array() + tolerance_).all()))
      throw InputError(file_, key, box_text(box),
                       "within the domain, " + box_text({scene_.domain.min, scene_.domain.max}));
    if (scene_.floor && !(box.min.z() >= scene_.floor->height - tolerance_))
      throw InputError(file_, key + ".min[2]", to_text(box.min.z()),
                       ">= " + to_text(scene_.floor->height) + ", the floor's height");
    for (const auto& container : scene_.containers) {
      const auto* shape = std::get_if<BoxShape>(&container.shape);
      if (shape && !moves(container) && !is_around(fill, container.name))
        clear_of_boxes({box.min - container.origin, box.max - container.origin}, *shape, container.name, key);
    }
  }

  static bool is_around(const Fill& fill, const std::string& name) {
    return std::find(fill.around.begin(), fill.around.end(), name) != fill.around.end();
  }

  void goes_around(const Fill& fill, const std::string& key) const {
    for (const auto& name : fill.around) {
      const bool there = std::any_of(scene_.containers.begin(), scene_.containers.end(),
                                     [&](const Container& c) { return c.name == name; });
      if (!there || name == fill.container)
        throw InputError(file_, key + ".around", name, "the name of another container");
    }
  }

  /// \param box  in the frame of the union
  void clear_of_boxes(const SolidBox& box, const BoxShape& shape, const std::string& name,
                      const std::string& key) const {
    for (const auto& solid : shape.solid)
      if (overlap(box, solid, tolerance_))
        throw InputError(file_, key, box_text(box),
                         "clear of the walls of " + name + ", where a box stands at " + box_text(solid));
  }

  Eigen::Matrix3Xd particles_of(const Fill& fill, const std::string& key) const {
    Scene alone = scene_;
    alone.fills = {fill};
    try {
      return initial_state(alone).position;
    } catch (const std::runtime_error&) {
      throw InputError(file_, key, "no particle",
                       "room for at least one at the particle spacing " + to_text(scene_.particle_spacing));
    }
  }

  void stays_in_domain(const Eigen::Matrix3Xd& x, const std::string& key) const {
    for (int a = 0; a < 3; ++a) {
      const double low = x.row(a).minCoeff(), high = x.row(a).maxCoeff();
      if (!(low >= scene_.domain.min[a] && high < scene_.domain.max[a]))
        throw InputError(
            file_, key, std::string(1, "xyz"[a]) + " from " + to_text(rounded(low)) + " to " + to_text(rounded(high)),
            "within the domain, from " + to_text(scene_.domain.min[a]) + " to " + to_text(scene_.domain.max[a]));
    }
  }

  /// \param own  the container of the fill, whose walls initial_state has kept clear of; or null
  void clear_of_walls(const Eigen::Matrix3Xd& x, const Container* own, const std::string& key) const {
    // A hundredth allows for the rounding of positions to fp32.
    const double least = 0.49 * scene_.particle_spacing;
    for (const auto& container : scene_.containers) {
      if (&container == own) continue;
      const SolidDistance solid(container);
      const Pose pose = pose_at(container, 0.0);
      for (Eigen::Index i = 0; i < x.cols(); ++i) {
        const Vec3 local = pose.to_local(x.col(i));
        if (!solid.may_be_within(least, local)) continue;
        const double distance = solid.at(local).distance;
        if (!(distance >= least))
          throw InputError(file_, key,
                           "a particle at (" + to_text(rounded(x(0, i))) + ", " + to_text(rounded(x(1, i))) + ", " +
                               to_text(rounded(x(2, i))) + "), " + to_text(rounded(distance)) + " from the solid of " +
                               container.name,
                           "at least dx/2 = " + to_text(0.5 * scene_.particle_spacing) +
                               " from every wall; a fill leaves room for what its `around` names");
      }
    }
  }

  /// Lattices of fills that do not overlap are dx apart, because each begins dx/2 inside.
  void apart(const std::vector<Eigen::Matrix3Xd>& fills) const {
    if (fills.size() < 2) return;
    const double dx = scene_.particle_spacing, least = 0.99 * dx;
    struct Seen {
      std::size_t fill;
      Vec3 x;
    };
    const auto cell_of = [&](const Vec3& x) -> Eigen::Vector3i {
      return ((x - scene_.domain.min) / dx).array().floor().cast<int>();
    };
    const auto id_of = [](const Eigen::Vector3i& c) {
      // 21 bits an axis; the domain's check keeps its extent below 2^16 spacings.
      return (static_cast<std::int64_t>(c.x() + 1) << 42) | (static_cast<std::int64_t>(c.y() + 1) << 21) |
             static_cast<std::int64_t>(c.z() + 1);
    };
    std::unordered_multimap<std::int64_t, Seen> seen;
    for (std::size_t f = 0; f < fills.size(); ++f)
      for (Eigen::Index i = 0; i < fills[f].cols(); ++i) {
        const Vec3 x = fills[f].col(i);
        const Eigen::Vector3i cell = cell_of(x);
        for (int k = 0; f > 0 && k < 27; ++k) {
          const Eigen::Vector3i beside = cell + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
          const auto [first, last] = seen.equal_range(id_of(beside));
          for (auto it = first; it != last; ++it)
            if (it->second.fill != f && (it->second.x - x).norm() < least)
              throw InputError(file_, "fill[" + std::to_string(f) + "]",
                               "a particle " + to_text(rounded((it->second.x - x).norm())) + " from one of fill[" +
                                   std::to_string(it->second.fill) + "]",
                               "fills that do not overlap, particles >= dx = " + to_text(dx) + " apart");
        }
        seen.emplace(id_of(cell), Seen{f, x});
      }
  }

  const Scene& scene_;
  const std::string& file_;
  double tolerance_;  // m, so that decimal fractions that meet do meet
};

}  // namespace

void check_fluid(const Scene& scene, const std::string& file) { FluidChecks(scene, file).run(); }

}  // namespace decant
