/// \file
/// Columns of water that collapse: how far and how low (Martin & Moyce 1952; Koshizuka & Oka 1996),
/// and how hard they hit a wall (Lobovský et al. 2014; Buchner 2002) or an obstacle (Kleefsman et al.
/// 2005).
#include "tools/validation/observers.hpp"
#include "tools/validation/wall_patch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace decant::validate {
namespace {

constexpr std::int64_t fewest_neighbors = 6;  // of what counts as water and not as spray

double gravity_of(const Scene& scene) { return scene.gravity.norm(); }

/// Size of the column: along x, along z.
Vec3 column_of(const Scene& scene) {
  const SolidBox& box = *scene.fills.at(0).box;
  return box.max - box.min;
}

/// Front Z = x/a over T = t√(2g/a), height at the back wall over τ = t√(g/a), a the column's width, its
/// height 2a.
class DamFront : public Observer {
 public:
  explicit DamFront(const Inputs& inputs)
      : scene_(inputs.scene),
        a_(column_of(inputs.scene).x()),
        width_(column_of(inputs.scene).y()),
        folder_(inputs.experiments) {}

  void sample(const Moment& moment) override {
    const double dx = scene_.particle_spacing;
    double front = 0, beside_wall = 0;
    for (Eigen::Index i = 0; i < moment.state.size(); ++i) {
      if (moment.fields.fluid_neighbor_count[i] < fewest_neighbors) continue;
      front = std::max(front, moment.state.position(0, i) + 0.5 * dx);
      if (moment.state.position(0, i) < 0.2 * a_) beside_wall += 1;
    }
    // The volume over the ground it stands on: single particles that cling to the wall do not count.
    const double height = beside_wall * dx * dx * dx * scene_.mass_ratio / (0.2 * a_ * width_);
    front_.x.push_back(moment.time * std::sqrt(2 * gravity_of(scene_) / a_));
    front_.y.push_back(front / a_);
    height_.x.push_back(moment.time * std::sqrt(gravity_of(scene_) / a_));
    height_.y.push_back(height / (2 * a_));
  }

  void finish(Result& result) override {
    const Curve front = read_curve(folder_ / "martin_moyce_table2_front.csv"),
                height = read_curve(folder_ / "martin_moyce_table6_height.csv");
    // Coarser than 20 spacings to the column's width the gates do not apply.
    const double gate = a_ >= 19.99 * scene_.particle_spacing ? 0.10 : NAN;
    const double measured = slope(front, 1.4, 3.1), found = slope(front_, 1.4, 3.1);
    result.add({"front speed dZ/dT, T 1.4-3.1", "1", measured, found, std::abs(found / measured - 1), gate});
    const auto worst = [](const Curve& reference, const Curve& simulated, double from, double to) {
      double largest = 0, at = NAN, is = NAN;
      for (std::size_t k = 0; k < reference.x.size(); ++k) {
        if (reference.x[k] < from || reference.x[k] > to) continue;
        const double y = value_at(simulated, reference.x[k]);
        const double error = std::abs(y / reference.y[k] - 1);
        if (!(error <= largest)) {
          largest = error;
          at = reference.y[k];
          is = y;
        }
        if (std::isnan(error)) break;
      }
      return std::array{at, is, largest};
    };
    const auto late = worst(front, front_, 2.3, 9), early = worst(front, front_, 0.8, 1.4);
    result.add({"front Z, T >= 2.3, worst", "a", late[0], late[1], late[2], gate});
    result.add({"front Z, T 0.8-1.4, worst", "a", early[0], early[1], early[2]});
    const auto fallen = worst(height, height_, 0, 3);
    result.add({"height, tau <= 3, worst", "2a", fallen[0], fallen[1], fallen[2]});
    const auto curve = [&](const char* panel, const std::string& name, const char* x, const char* y, bool reference,
                           const Curve& points) {
      result.curves.push_back({panel, name, x, "1", y, "1", reference, points.x, points.y});
    };
    const char *T = "T = t √(2g/a)", *Z = "Z = x / a", *tau = "τ = t √(g/a)", *H = "height / 2a";
    curve("front", "Martin & Moyce 1952, a = 2.25 in", T, Z, true, front);
    curve("front", "the same, n² = 2, a = 1.125 in", T, Z, true,
          read_curve(folder_ / "martin_moyce_n2sq2_a1.125in.csv"));
    curve("front", "Koshizuka & Oka 1996", T, Z, true, read_curve(folder_ / "koshizuka_oka_1996_pysph.csv"));
    // Given in seconds and metres for a = 1 m.
    Curve second = read_curve(folder_ / "koshizuka_oka_1996_dualsphysics_L1m.csv");
    for (double& t : second.x) t *= std::sqrt(2 * 9.81);
    curve("front", "the same, digitised anew", T, Z, true, second);
    curve("front", "simulated", T, Z, false, front_);
    curve("height", "Martin & Moyce 1952", tau, H, true, part_of(height, 0, height_.x.back()));
    curve("height", "simulated", tau, H, false, height_);
  }

 private:
  const Scene& scene_;
  double a_, width_;
  std::filesystem::path folder_;
  Curve front_, height_;
};

/// One pressure probe of an experiment.
struct Probe {
  const char *name, *file;
  double height;  // m above the floor
  bool gated;
};

/// Pressure p* = p/(ρ g H) over t* = t√(g/H) on patches of a wall or of an obstacle that the wave hits.
class Impact : public Observer {
 public:
  /// \param face  x of the surface that is hit, m; \param direction  +1 where the wave runs along +x
  Impact(const Inputs& inputs, double face, int direction, double y_min, double y_max, std::vector<Probe> probes)
      : scene_(inputs.scene),
        folder_(inputs.experiments),
        height_(column_of(inputs.scene).z()),
        probes_(std::move(probes)),
        found_(probes_.size()) {
    const double dx = scene_.particle_spacing;
    for (const Probe& probe : probes_) {
      // As wide as the flow is even, two rows above and below the probe, and no nearer to the floor.
      const double low = std::max(probe.height - 2 * dx, 0.0);
      SolidBox box;
      box.min = {direction > 0 ? face : face - 2 * dx, y_min + 2 * dx, low};
      box.max = {direction > 0 ? face + 2 * dx : face, y_max - 2 * dx, low + 4 * dx};
      patches_.emplace_back(scene_, inputs.walls, box, Vec3(direction, 0, 0));
      away_.push_back(probe.height >= 2 * dx);
    }
  }

  void sample(const Moment& moment) override {
    const double scale = scene_.fluid.rest_density * gravity_of(scene_) * height_;
    for (std::size_t k = 0; k < probes_.size(); ++k) {
      found_[k].x.push_back(moment.time * std::sqrt(gravity_of(scene_) / height_));
      found_[k].y.push_back(patches_[k].pressure(moment.state, moment.fields) / scale);
    }
  }

  void finish(Result& result) override {
    for (std::size_t k = 0; k < probes_.size(); ++k) {
      const Probe& probe = probes_[k];
      const Curve measured = read_curve(folder_ / probe.file);
      const double highest = *std::max_element(measured.y.begin(), measured.y.end());
      const double arrival = first_reach(measured, 0.25 * highest), arrived = first_reach(found_[k], 0.25 * highest);
      // Some of the digitised points are far apart: it may have come at any time between two.
      const auto [earliest, latest] = first_reach_between(measured, 0.25 * highest);
      const double late = std::max({earliest - arrived, arrived - latest, 0.0});
      const bool gated = probe.gated && away_[k];
      const std::string name = std::string(probe.name) + ": ";
      result.add({name + "arrival t*", "√(H/g)", arrival, arrived, std::isnan(arrived) ? NAN : late / arrival,
                  gated ? 0.10 : NAN});
      // From a little before the wave's arrival to the end of what both have.
      const double from = arrival - 0.2, to = std::min(measured.x.back(), found_[k].x.back());
      const double impulse = integral(measured, from, to), pushed = integral(found_[k], from, to);
      result.add({name + "impulse ∫p* dt*", "ρgH √(H/g)", impulse, pushed, std::abs(pushed / impulse - 1),
                  gated ? 0.15 : NAN});
      const double peak = *std::max_element(found_[k].y.begin(), found_[k].y.end());
      result.add({name + "peak", "ρgH", highest, peak, std::abs(peak / highest - 1)});
      const auto curve = [&](const std::string& title, bool reference, const Curve& c) {
        result.curves.push_back({probe.name, title, "t* = t √(g/H)", "1", "p / ρgH", "1", reference, c.x, c.y});
      };
      curve("measured", true, measured);
      curve("simulated", false, found_[k]);
    }
  }

 private:
  const Scene& scene_;
  std::filesystem::path folder_;
  double height_;
  std::vector<Probe> probes_;
  std::vector<WallPatch> patches_;
  std::vector<bool> away_;  // from the floor, by 2 dx at least
  std::vector<Curve> found_;
};

/// The cavity of the scene's only tank.
SolidBox tank_of(const Scene& scene) { return std::get<BoxShape>(scene.containers.at(0).shape).cavity; }

}  // namespace

std::unique_ptr<Observer> observe_dam_front(const Inputs& inputs) { return std::make_unique<DamFront>(inputs); }

std::unique_ptr<Observer> observe_dam_wall(const Inputs& inputs) {
  const SolidBox tank = tank_of(inputs.scene);
  // Buchner's column was twice as high: his probe stands at a fifth of the column's height.
  const double H = column_of(inputs.scene).z();
  return std::make_unique<Impact>(inputs, tank.max.x(), +1, tank.min.y(), tank.max.y(),
                                  std::vector<Probe>{{"Lobovský, 3 mm", "lobovsky_2014_p1.csv", 0.003, false},
                                                     {"Lobovský, 30 mm", "lobovsky_2014_p3.csv", 0.030, true},
                                                     {"Lobovský, 80 mm", "lobovsky_2014_p4.csv", 0.080, true},
                                                     {"Buchner, 0.2 H", "buchner_2002_p.csv", 0.2 * H, true}});
}

std::unique_ptr<Observer> observe_dam_obstacle(const Inputs& inputs) {
  // The last solid of the list is the obstacle.
  const SolidBox box = std::get<BoxShape>(inputs.scene.containers.at(0).shape).solid.back();
  return std::make_unique<Impact>(inputs, box.max.x(), -1, box.min.y(), box.max.y(),
                                  std::vector<Probe>{{"Kleefsman, P1", "kleefsman_2005_p1.csv", 0.021, true},
                                                     {"Kleefsman, P3", "kleefsman_2005_p3.csv", 0.101, true}});
}

}  // namespace decant::validate
