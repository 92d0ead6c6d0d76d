/// \file
/// Refuses scenes that could only explode, leak or mislead: first each length by itself, then the
/// containers among each other, then the fluid in them, and last the substep.
#include "reference/scene_checks.hpp"

#include "reference/error.hpp"
#include "reference/fluid_checks.hpp"
#include "reference/pose.hpp"
#include "reference/scene_json_reader.hpp"
#include "reference/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace decant {
namespace {

std::string at(const std::string& list, std::size_t index) { return list + "[" + std::to_string(index) + "]"; }

std::string point_text(const Vec3& x) {
  return fmt::format("({}, {}, {})", to_text(rounded(x.x())), to_text(rounded(x.y())), to_text(rounded(x.z())));
}

/// Lengths are compared with this much slack, so that decimal fractions that meet do meet.
double tolerance(const Scene& scene) { return 1e-6 * scene.particle_spacing; }

class Checks {
 public:
  Checks(const Scene& scene, const std::string& file) : scene_(scene), file_(file) {}

  std::vector<std::string> run(Distances distances) {
    resolution();
    domain();
    for (std::size_t i = 0; i < scene_.containers.size(); ++i) container(i);
    for (std::size_t i = 0; i < scene_.containers.size() && distances == Distances::unknown; ++i)
      for (std::size_t j = 0; j < i; ++j) clearance(i, j);
    check_fluid(scene_, file_);
    time();
    return warnings_;
  }

 private:
  /// \param holds  written so that a NaN in it refuses
  void require(bool holds, const std::string& key, const std::string& value, const std::string& bound) const {
    if (!holds) throw InputError(file_, key, value, bound);
  }

  void resolution() {
    const double dx = scene_.particle_spacing;
    require(dx > 0 && std::isfinite(dx), "particle_spacing", to_text(dx), "a number > 0");
    require(scene_.support_ratio >= 1.5, "support_ratio", to_text(scene_.support_ratio),
            ">= 1.5 (support radius H / dx); below it a particle has too few neighbors");
    if (scene_.mass_ratio == 1.0 && scene_.support_ratio == 2.0) {
      // Sums of W over a cubic lattice at H = 2 dx, in rest densities.
      if (scene_.kernel == KernelFamily::wendland_c2)
        warnings_.push_back(
            "mass_ratio = 1: wendland_c2 counts 1.0338 rest densities on the initial"
            " lattice, so the fluid starts compressed; 1 / 1.0338 calibrates it");
      if (scene_.kernel == KernelFamily::mueller2003)
        warnings_.push_back(
            "mass_ratio = 1: mueller2003 counts 1.0098 rest densities on the initial"
            " lattice, so the fluid starts compressed; 1 / 1.0098 calibrates it");
    }
  }

  void domain() {
    const double dx = scene_.particle_spacing;
    const double reach = scene_.domain.min.cwiseAbs().cwiseMax(scene_.domain.max.cwiseAbs()).maxCoeff();
    // Half an ulp of the largest fp32 coordinate is at most reach · 2⁻²⁴.
    const double farthest = 1e-3 * dx * 0x1p24;
    require(reach <= farthest, "domain", to_text(reach),
            "no coordinate beyond " + to_text(rounded(farthest)) +
                ", where single precision rounds positions by more than dx/1000");
    const Vec3 extent = scene_.domain.max - scene_.domain.min;
    for (int a = 0; a < 3; ++a) {
      require(extent[a] > 0, "domain.max[" + std::to_string(a) + "]", to_text(scene_.domain.max[a]),
              "greater than domain.min");
      if (!periodic(a)) continue;
      const double least = 3 * scene_.support_radius();
      require(extent[a] >= least - tolerance(scene_), "domain.periodic", axis_name(a),
              "a period >= 3 H = " + to_text(least) + ", not " + to_text(extent[a]));
      const double cells = extent[a] / dx;
      if (std::abs(cells - std::round(cells)) > 1e-6 * cells)
        warnings_.push_back("domain: the period along " + axis_name(a) + " is " + to_text(rounded(cells)) +
                            " particle spacings, not a whole number; a fill across it leaves a gap");
    }
  }

  void container(std::size_t i) {
    const Container& c = scene_.containers[i];
    const std::string key = at("containers", i);
    for (std::size_t j = 0; j < i; ++j)
      require(scene_.containers[j].name != c.name, key + ".name", c.name,
              "a name of its own; " + at("containers", j) + " has it already");
    const double support = scene_.support_radius();
    const double layers = scene_.wall_layers * scene_.particle_spacing;
    require(c.wall_thickness >= support - tolerance(scene_), key + ".wall_thickness", to_text(c.wall_thickness),
            ">= H = " + to_text(support) + "; the support would reach through the wall of " + c.name);
    require(c.wall_thickness >= layers - tolerance(scene_), key + ".wall_thickness", to_text(c.wall_thickness),
            ">= wall_layers · dx = " + to_text(layers) + "; the layers would leave the solid");
    if (c.tilt) tilt(c, key + ".tilt");
    if (c.translation) translation(c, key + ".translation");
    if (const auto* boxes = std::get_if<BoxShape>(&c.shape)) spans_periods(c, *boxes, key);
    inside_domain(c, key);
  }

  void tilt(const Container& c, const std::string& key) {
    schedule(c.tilt->keys, key, [](const TiltKey& k) { return Vec3(k.angle, 0, 0); });
    require(std::isfinite(c.tilt->rate), key + ".rate", to_text(c.tilt->rate), "a finite number");
    if (c.tilt->oscillation) oscillation(*c.tilt->oscillation, Vec3(c.tilt->oscillation->amplitude, 0, 0), key);
    require(std::abs(c.tilt->axis.norm() - 1) < 1e-6, key + ".axis", point_text(c.tilt->axis), "a unit vector");
    const Vec3& pivot = c.tilt->pivot;
    require((pivot.array() >= scene_.domain.min.array()).all() && (pivot.array() <= scene_.domain.max.array()).all(),
            key + ".pivot", point_text(pivot), "a point in the domain");
    for (int a = 0; a < 3; ++a)
      require(!periodic(a), key, "tilts", "no tilt, because the domain is periodic along " + axis_name(a));
  }

  void translation(const Container& c, const std::string& key) {
    const Translation& t = *c.translation;
    schedule(t.keys, key, [](const TranslationKey& k) { return k.offset; });
    require(t.velocity.allFinite(), key + ".velocity", point_text(t.velocity), "finite numbers");
    if (t.oscillation) oscillation(*t.oscillation, t.oscillation->amplitude, key);
    if (!std::holds_alternative<BoxShape>(c.shape)) return;
    for (int a = 0; a < 3; ++a) {
      bool along = t.velocity[a] != 0 || (t.oscillation && t.oscillation->amplitude[a] != 0);
      for (const auto& k : t.keys) along = along || k.offset[a] != 0;
      require(!(periodic(a) && along), key, "along " + axis_name(a),
              "no translation along " + axis_name(a) + ", because " + c.name +
                  " spans the domain's period there; surface_velocity lets its surface run");
    }
  }

  /// \param value  (key) → what is finite
  template <class Key, class Value>
  void schedule(const std::vector<Key>& keys, const std::string& key, Value value) {
    require(!keys.empty(), key + ".keys", "[]", "at least one key");
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const std::string here = key + "." + at("keys", k);
      require(std::isfinite(keys[k].time) && value(keys[k]).allFinite(), here, to_text(keys[k].time), "finite numbers");
      require(k == 0 || keys[k].time > keys[k - 1].time, here + ".time", to_text(keys[k].time),
              "later than the key before it");
    }
  }

  template <class Value>
  void oscillation(const Oscillation<Value>& o, const Vec3& amplitude, const std::string& key) {
    require(amplitude.allFinite() && std::isfinite(o.phase), key + ".oscillation", point_text(amplitude),
            "finite numbers");
    require(o.frequency > 0 && std::isfinite(o.frequency), key + ".oscillation.frequency", to_text(o.frequency),
            "> 0, Hz");
  }

  /// Along a periodic axis every box of a union, its cavity too, goes from end to end.
  void spans_periods(const Container& c, const BoxShape& shape, const std::string& key) {
    for (int a = 0; a < 3; ++a) {
      require(shape.endless[static_cast<std::size_t>(a)] == periodic(a), key + ".boxes", axis_name(a),
              "endless along the domain's periodic axes and no other");
      if (!periodic(a)) continue;
      const double slack = 1e-9 * (scene_.domain.max[a] - scene_.domain.min[a]);
      std::vector<SolidBox> boxes = shape.solid;
      boxes.push_back(shape.cavity);
      for (const auto& box : boxes) {
        const double from = c.origin[a] + box.min[a], to = c.origin[a] + box.max[a];
        require(std::abs(from - scene_.domain.min[a]) <= slack && std::abs(to - scene_.domain.max[a]) <= slack, key,
                axis_name(a) + " from " + to_text(from) + " to " + to_text(to),
                "exactly the period, from " + to_text(scene_.domain.min[a]) + " to " + to_text(scene_.domain.max[a]) +
                    ", because the domain is periodic along " + axis_name(a));
      }
    }
  }

  void inside_domain(const Container& c, const std::string& key) {
    const auto rings = solid_rings(c);
    const std::string place = key + (c.tilt ? ".tilt" : c.translation ? ".translation" : ".origin");
    const auto reach = [&](const Vec3& direction) { return farthest_along(direction, rings, &c, scene_.schedule.end); };
    const bool revolved = std::holds_alternative<RevolvedShape>(c.shape);
    for (int a = 0; a < 3; ++a) {
      if (periodic(a) && !revolved) continue;
      // The image beyond a periodic boundary is as near as the boundary twice.
      const double margin = periodic(a) ? scene_.support_radius() : 0.0;
      const std::string why = periodic(a) ? ", H inside the periodic boundary" : ", the domain's end";
      const double low = -reach(-Vec3::Unit(a)), high = reach(Vec3::Unit(a));
      require(low >= scene_.domain.min[a] + margin - tolerance(scene_), place,
              c.name + " reaches " + axis_name(a) + " = " + to_text(rounded(low)),
              ">= " + to_text(scene_.domain.min[a] + margin) + why);
      require(high <= scene_.domain.max[a] - margin + tolerance(scene_), place,
              c.name + " reaches " + axis_name(a) + " = " + to_text(rounded(high)),
              "<= " + to_text(scene_.domain.max[a] - margin) + why);
    }
    if (!scene_.floor) return;
    const double low = -reach(-Vec3::UnitZ());
    require(low >= scene_.floor->height - tolerance(scene_), place, c.name + " reaches z = " + to_text(rounded(low)),
            ">= " + to_text(scene_.floor->height) + ", the floor's height");
  }

  void clearance(std::size_t i, std::size_t j) {
    const Container &a = scene_.containers[i], &b = scene_.containers[j];
    const double support = scene_.support_radius();
    const Approach near = closest_approach(a, b, scene_.schedule.end, support - tolerance(scene_), 0.05 * support);
    if (near.distance >= support - tolerance(scene_)) return;
    require(false, at("containers", i),
            a.name + " and " + b.name +
                (near.distance < 0 ? " overlap by " + to_text(rounded(-near.distance))
                                   : " are " + to_text(rounded(near.distance)) + " apart") +
                " at t = " + to_text(rounded(near.time)) + ", " + point_text(near.where),
            "apart by >= H = " + to_text(support) + " at all times");
  }

  void time() {
    const Schedule& s = scene_.schedule;
    require(s.end > 0 && s.frames >= 1, "time.end", to_text(s.end), "> 0, and frames >= 1");
    require(s.courant > 0 && s.courant <= 0.4, "time.courant", to_text(s.courant), "in (0, 0.4]");
    const double fastest = speed();
    const double sound = scene_.fluid.sound_speed;
    const std::string reason = ", where the speed to expect is " + to_text(rounded(fastest)) +
                               " m/s (from the fall height, or time.max_speed)";
    require(sound >= 4 * fastest, "fluid.sound_speed", to_text(sound),
            ">= 4 v_max = " + to_text(rounded(4 * fastest)) + reason);
    if (sound < 10 * fastest) {
      const double percent = 100 * (fastest / sound) * (fastest / sound);
      warnings_.push_back("fluid.sound_speed = " + to_text(sound) +
                          ": below 10 v_max = " + to_text(rounded(10 * fastest)) + reason +
                          "; expect the fluid to compress by up to " + to_text(rounded(percent)) + " %");
    }
    const int substeps = s.substeps_per_frame;
    require(substeps >= 1, "time.substeps_per_frame", std::to_string(substeps), "at least 1");
    const double cfl_bound = 0.4 * scene_.smoothing_length() / (sound + fastest);
    const double bound = longest_time_step(scene_, 0.4, fastest);
    const double frame = s.end / s.frames;
    require(scene_.time_step() <= bound * (1 + 1e-12), "time.substeps_per_frame", std::to_string(substeps),
            ">= " + to_text(std::ceil(frame / bound)) + ": dt = " + to_text(rounded(scene_.time_step())) +
                " s passes " +
                (bound < cfl_bound ? "the viscous limit 0.125 h² rho0 / max(mu, mu_w / 2) = "
                                   : "the CFL limit 0.4 h / (c0 + v_max) = ") +
                to_text(rounded(bound)) + " s");
  }

  /// The speed to expect; what it refuses is refused in this file's name.
  double speed() const {
    try {
      return expected_max_speed(scene_);
    } catch (const InputError& error) {
      throw InputError(file_, error.key(), error.value(), error.bound());
    }
  }

  bool periodic(int axis) const { return scene_.domain.periodic[static_cast<std::size_t>(axis)]; }
  static std::string axis_name(int axis) { return std::string(1, "xyz"[axis]); }

  const Scene& scene_;
  const std::string& file_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::vector<std::string> check_scene(const Scene& scene, const std::string& file, Distances distances) {
  return Checks(scene, file).run(distances);
}

}  // namespace decant
