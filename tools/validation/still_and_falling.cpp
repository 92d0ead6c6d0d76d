/// \file
/// Fluid without flow: a blob that falls freely, water that stands in a tank or a cup.
#include "oracle/solution/tolerance.hpp"
#include "reference/distance.hpp"
#include "tools/validation/observers.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace decant::validate {
namespace {

/// Against the integrator's own exact solution: v = v0 + g n dt, x = x0 + v0 n dt + g dt² n(n+1)/2, because
/// pair forces cancel in the sum. What rounding may add is followed along the run: in each substep
/// the tolerance of an acceleration times dt (oracle/solution/tolerance.hpp; averaged over particles, signs taken
/// as all alike), two roundings of the velocity and two of the position.
class FreeFall : public Observer {
 public:
  explicit FreeFall(const Inputs& inputs)
      : scene_(inputs.scene), walls_(inputs.walls), unit_(inputs.single_precision ? unit_roundoff : 0x1p-53) {}

  void sample(const Moment& moment) override {
    const Vec3 x = moment.state.position.rowwise().mean(), v = moment.state.velocity.rowwise().mean();
    const auto n = static_cast<double>(moment.state.substep);
    const double dt = scene_.time_step();
    if (moment.state.substep == 0) {
      x_ = x;
      v_ = v;
    } else {
      const auto substeps = n - last_substep_;
      velocity_bound_ += substeps * (dt * tolerance_ + 2 * unit_ * fastest_);
      position_bound_ += substeps * (dt * velocity_bound_ + 2 * unit_ * farthest_);
      velocity_error_ = (v - v_ - n * dt * scene_.gravity).norm();
      position_error_ = (x - x_ - n * dt * v_ - 0.5 * n * (n + 1) * dt * dt * scene_.gravity).norm();
      fallen_ = 0.5 * n * (n + 1) * dt * dt * scene_.gravity.norm();
      gained_ = n * dt * scene_.gravity.norm();
      time_.push_back(moment.time);
      error_over_bound_.push_back(velocity_error_ / velocity_bound_);
    }
    last_substep_ = n;
    const ReferenceSolution oracle = reference_solution(scene_, walls_, moment.state);
    tolerance_ = std::max(tolerance_, oracle.tolerance.acceleration.colwise().norm().mean() * unit_ / unit_roundoff);
    fastest_ = std::max(fastest_, moment.state.velocity.cwiseAbs().maxCoeff() + gained_);
    farthest_ = std::max(farthest_, moment.state.position.cwiseAbs().maxCoeff());
  }

  void finish(Result& result) override {
    result.add({"mean velocity", "m/s", gained_, gained_ + velocity_error_, velocity_error_ / gained_,
                velocity_bound_ / gained_});
    result.add({"mean position", "m", fallen_, fallen_ + position_error_, position_error_ / fallen_,
                position_bound_ / fallen_});
    result.curves.push_back({"momentum", "error of the mean velocity", "t", "s", "error / what rounding may add", "1",
                             false, time_, error_over_bound_});
  }

 private:
  const Scene& scene_;
  const Walls& walls_;
  double unit_;
  Vec3 x_ = Vec3::Zero(), v_ = Vec3::Zero();
  double last_substep_ = 0, tolerance_ = 0, fastest_ = 0, farthest_ = 0;
  double velocity_bound_ = 0, position_bound_ = 0, velocity_error_ = 0, position_error_ = 0;
  double fallen_ = 0, gained_ = 0;
  std::vector<double> time_, error_over_bound_;
};

/// Area of a container's room for fluid at half its height, m², and where its bottom is, m.
struct Room {
  double area, bottom;
};
Room room_of(const Scene& scene) {
  const Container& container = scene.containers.at(0);
  if (const auto* box = std::get_if<BoxShape>(&container.shape)) {
    Vec3 size = box->cavity.max - box->cavity.min;
    for (int a = 0; a < 2; ++a)
      if (scene.domain.periodic[static_cast<std::size_t>(a)]) size[a] = scene.domain.max[a] - scene.domain.min[a];
    return {size.x() * size.y(), container.origin.z() + box->cavity.min.z()};
  }
  const auto& profile = std::get<RevolvedShape>(container.shape).profile;
  double bottom = -INFINITY;
  for (const auto& p : profile)
    if (p[0] == 0) bottom = std::max(bottom, p[1]);
  const SolidDistance solid(container);
  // From the axis outward to the wall, above the bottom by more than that.
  double inner = 0, outer = 0;
  for (const auto& p : profile) outer = std::max(outer, p[0]);
  const double height = bottom + scene.fills.at(0).level;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (inner + outer);
    (solid.at({middle, 0, height}).distance > 0 ? inner : outer) = middle;
  }
  return {std::numbers::pi * inner * inner, container.origin.z() + bottom};
}

/// Against p = ρ g (H − z), H the level that the mass of the fluid stands for. Layer by layer of dx,
/// averaged over the last quarter of the run, away from side walls by 2 dx; the particles beside
/// the walls are told apart.
class StillWater : public Observer {
 public:
  explicit StillWater(const Inputs& inputs)
      : scene_(inputs.scene),
        resolution_(inputs.resolution),
        room_(room_of(inputs.scene)),
        solid_(inputs.scene.containers.at(0)) {}

  void sample(const Moment& moment) override {
    const ParticleState& state = moment.state;
    level_ = static_cast<double>(state.size()) * scene_.particle_mass() / (scene_.fluid.rest_density * room_.area);
    if (moment.time < 0.75 * scene_.schedule.end) return;
    for (Eigen::Index i = 0; i < state.size(); ++i) {
      const double z = state.position(2, i) - room_.bottom;
      top_ = std::max(top_, z);
      fastest_ = std::max(fastest_, state.velocity.col(i).norm());
      // The distance to the sides: as high as the middle, where the bottom is no nearer than they are.
      Vec3 x = state.position.col(i) - scene_.containers[0].origin;
      x.z() += 0.5 * level_ - z;
      const double aside = solid_.at(x).distance, dx = scene_.particle_spacing;
      if (z > 2 * dx && aside < dx) {
        beside_ += moment.fields.pressure[i];
        beside_exact_ += scene_.fluid.rest_density * scene_.gravity.norm() * (level_ - z);
      }
      if (aside < 2 * dx) continue;
      const auto k = static_cast<std::size_t>(std::max(0.0, z / scene_.particle_spacing));
      if (k >= layers_.size()) layers_.resize(k + 1);
      layers_[k].z += z;
      layers_[k].p += moment.fields.pressure[i];
      layers_[k].n += 1;
    }
  }

  void finish(Result& result) override {
    const double scale = scene_.fluid.rest_density * scene_.gravity.norm();
    NamedCurve found{"pressure", "simulated", "p / ρgH", "1", "z / H", "1", false, {}, {}};
    double squares = 0, first = NAN, at_first = NAN;
    int counted = 0;
    for (const Layer& layer : layers_) {
      if (layer.n == 0) continue;
      const double z = layer.z / layer.n, p = layer.p / layer.n, exact = scale * (level_ - z);
      found.x.push_back(p / (scale * level_));
      found.y.push_back(z / level_);
      if (std::isnan(first)) {
        first = p;
        at_first = exact;
      }
      if (z < 2 * scene_.particle_spacing || z > level_) continue;
      squares += (p - exact) * (p - exact);
      ++counted;
    }
    const double rms = counted ? std::sqrt(squares / counted) / (scale * level_) : NAN;
    // Coarser than 20 layers the gate does not apply.
    result.add({"pressure from 2 dx up, RMS", "ρgH", 0, rms, rms, resolution_ >= 20 ? 0.02 : NAN});
    result.add({"pressure of the first layer", "Pa", at_first, first, std::abs(first / at_first - 1)});
    result.add({"pressure beside the walls, over the exact one", "1", 1, beside_ / beside_exact_,
                std::abs(beside_ / beside_exact_ - 1)});
    const double level = top_ + 0.5 * scene_.particle_spacing;
    result.add({"level", "m", level_, level, std::abs(level / level_ - 1)});
    result.add({"fastest particle", "m/s", 0, fastest_, fastest_ / std::sqrt(scene_.gravity.norm() * level_)});
    result.curves.push_back(std::move(found));
    result.curves.push_back({"pressure", "hydrostatic", "p / ρgH", "1", "z / H", "1", true, {1, 0}, {0, 1}});
  }

 private:
  struct Layer {
    double z = 0, p = 0;
    int n = 0;
  };
  const Scene& scene_;
  int resolution_;
  Room room_;
  SolidDistance solid_;
  std::vector<Layer> layers_;
  double level_ = 0, top_ = 0, fastest_ = 0, beside_ = 0, beside_exact_ = 0;
};

}  // namespace

std::unique_ptr<Observer> observe_free_fall(const Inputs& inputs) { return std::make_unique<FreeFall>(inputs); }

std::unique_ptr<Observer> observe_still_water(const Inputs& inputs) { return std::make_unique<StillWater>(inputs); }

}  // namespace decant::validate
