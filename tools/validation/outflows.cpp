/// \file
/// Water that leaves: through a slit in the bottom of a tank, and over the lip of a cup that leans.
#include "oracle/checks/audit.hpp"
#include "tools/validation/observers.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace decant::validate {
namespace {

/// Torricelli: √h falls at the rate C_d (a/A) √(g/2), C_d = π/(π + 2) = 0.611 of a slit with sharp edges
/// (Kirchhoff 1869). h is the volume above the slit over the tank's area.
class Slit : public Observer {
 public:
  explicit Slit(const Inputs& inputs) : scene_(inputs.scene) {
    // The two plates beside the slit come first in the list of solids; they end the upper tank.
    const BoxShape& shape = std::get<BoxShape>(scene_.containers.at(0).shape);
    const SolidBox &left = shape.solid.at(0), &right = shape.solid.at(1);
    slit_ = right.min.x() - left.max.x();
    level_ = left.max.z();
    width_ = shape.cavity.max.x() - shape.cavity.min.x();
    thickness_ = scene_.domain.max.y() - scene_.domain.min.y();
  }

  void sample(const Moment& moment) override {
    const double above = static_cast<double>((moment.state.position.row(2).array() > level_).count());
    const double h = above * scene_.particle_mass() / (scene_.fluid.rest_density * width_ * thickness_);
    root_.x.push_back(moment.time);
    root_.y.push_back(std::sqrt(h));
  }

  void finish(Result& result) override {
    // From where the flow has established itself to where the surface dips towards the slit.
    Curve steady;
    for (std::size_t k = 0; k < root_.x.size(); ++k)
      if (root_.y[k] <= std::sqrt(0.85) * root_.y.front() && root_.y[k] >= std::sqrt(0.45) * root_.y.front()) {
        steady.x.push_back(root_.x[k]);
        steady.y.push_back(root_.y[k]);
      }
    const double g = scene_.gravity.norm();
    const double found = -slope(steady, -INFINITY, INFINITY) * width_ / slit_ / std::sqrt(g / 2);
    const double exact = std::numbers::pi / (std::numbers::pi + 2);
    result.add({"discharge coefficient", "1", exact, found, std::abs(found / exact - 1),
                slit_ >= 15.99 * scene_.particle_spacing ? 0.10 : NAN});
    Curve line;
    if (!steady.x.empty())
      for (const double t : {steady.x.front(), steady.x.back()}) {
        line.x.push_back(t);
        line.y.push_back(steady.y.front() - exact * slit_ / width_ * std::sqrt(g / 2) * (t - steady.x.front()));
      }
    result.curves.push_back({"head", "simulated", "t", "s", "√h", "√m", false, root_.x, root_.y});
    result.curves.push_back({"head", "Torricelli, C_d = 0.611", "t", "s", "√h", "√m", true, line.x, line.y});
  }

 private:
  const Scene& scene_;
  double slit_ = 0, level_ = 0, width_ = 0, thickness_ = 0;
  Curve root_;
};

/// What the cup holds at the end of each pause of its tilt against the exact volume below its lip.
class SlowPour : public Observer {
 public:
  explicit SlowPour(const Inputs& inputs) : scene_(inputs.scene), resolution_(inputs.resolution), audit_(inputs.scene) {
    const auto& cup = std::get<RevolvedShape>(scene_.containers.at(0).shape).profile;
    // The lip is the innermost point of the highest ones; the bottom meets the axis.
    double top = -INFINITY, bottom = -INFINITY;
    for (const auto& p : cup) top = std::max(top, p[1]);
    radius_ = INFINITY;
    for (const auto& p : cup) {
      if (p[1] == top) radius_ = std::min(radius_, p[0]);
      if (p[0] == 0) bottom = std::max(bottom, p[1]);
    }
    height_ = top - bottom;
  }

  void sample(const Moment& moment) override {
    const AuditResult audit = audit_.sample(moment.state);
    volume_.x.push_back(moment.time);
    volume_.y.push_back(audit.mass_at[static_cast<std::size_t>(Region::source)] / scene_.fluid.rest_density);
    // Paths are not judged: between two frames a particle turns around the rim.
    inside_ += audit.inside;
  }

  void finish(Result& result) override {
    const double whole = std::numbers::pi * radius_ * radius_ * height_;
    const auto& keys = scene_.containers.at(0).tilt->keys;
    NamedCurve exact{"volume", "exact, slow", "t", "s", "volume", "mL", true, {}, {}};
    for (std::size_t k = 1; k < keys.size(); ++k) {
      if (keys[k].angle != keys[k - 1].angle) continue;  // a pause is two keys of one angle
      const double angle = keys[k].angle, end = std::min(keys[k].time, volume_.x.back());
      const double should = cup_residual(radius_, height_, angle), is = value_at(volume_, end);
      const double degrees = angle * 180 / std::numbers::pi;
      // Below 20 dx, and where it is nearly empty, the residual is reported only.
      const bool gated = resolution_ >= 20 && degrees > 14.9 && degrees < 60.1;
      const std::string at = std::to_string(static_cast<int>(std::lround(degrees))) + "°";
      result.add(
          {"residual at " + at, "mL", 1e6 * should, 1e6 * is, std::abs(is - should) / whole, gated ? 0.04 : NAN});
      const double rate = -slope(volume_, end - 0.5, end) / whole;
      result.add({"still flowing at " + at + ", share a second", "1/s", 0, rate, std::abs(rate), gated ? 0.001 : NAN});
      exact.x.insert(exact.x.end(), {keys[k - 1].time, keys[k].time, NAN});
      exact.y.insert(exact.y.end(), {1e6 * should, 1e6 * should, NAN});
    }
    result.add({"particles seen inside a wall", "1", 0, static_cast<double>(inside_), static_cast<double>(inside_), 0});
    NamedCurve found{"volume", "simulated", "t", "s", "volume", "mL", false, volume_.x, {}};
    for (const double v : volume_.y) found.y.push_back(1e6 * v);
    result.curves.push_back(std::move(exact));
    result.curves.push_back(std::move(found));
  }

 private:
  const Scene& scene_;
  int resolution_;
  Audit audit_;
  double radius_ = 0, height_ = 0;
  Curve volume_;
  std::int64_t inside_ = 0;
};

}  // namespace

std::unique_ptr<Observer> observe_slit(const Inputs& inputs) { return std::make_unique<Slit>(inputs); }

std::unique_ptr<Observer> observe_slow_pour(const Inputs& inputs) { return std::make_unique<SlowPour>(inputs); }

}  // namespace decant::validate
