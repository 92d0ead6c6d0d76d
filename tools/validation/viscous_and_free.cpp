/// \file
/// Flows that have a solution: between plates, and a drop that is stretched without gravity.
#include "tools/validation/observers.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace decant::validate {
namespace {

/// Velocity along x between plates at z = 0 and z = L against the start-up's series.
class Channel : public Observer {
 public:
  Channel(const Inputs& inputs, double peak, std::function<double(double, double)> exact)
      : scene_(inputs.scene),
        resolution_(inputs.resolution),
        length_(inputs.resolution * inputs.scene.particle_spacing),
        peak_(peak),
        exact_(std::move(exact)) {}

  void sample(const Moment& moment) override {
    const double nu = scene_.fluid.viscosity / scene_.fluid.rest_density;
    const double diffusion = moment.time * nu / (length_ * length_);  // of 1 across the channel
    if (moment.time > 0) run_checks(moment, diffusion);
    const double next[] = {0.02, 0.05, 0.1, 0.2, 0.5};
    if (drawn_ < std::size(next) && diffusion >= next[drawn_] * (1 - 1e-9)) {
      draw(moment, diffusion);
      ++drawn_;
    }
  }

  void finish(Result& result) override {
    const auto worst = [](const std::vector<double>& y, std::size_t from) {
      double largest = from < y.size() ? 0.0 : NAN;
      for (std::size_t k = from; k < y.size(); ++k)
        largest = y[k] >= largest ? y[k] : (std::isnan(y[k]) ? y[k] : largest);
      return largest;
    };
    const double rms = worst(rms_.y, first_judged_);
    result.add({"velocity, largest RMS from 0.1 L²/ν on", "peak", 0, rms, rms, resolution_ >= 20 ? 0.02 : NAN});
    const double last = rms_.y.empty() ? NAN : rms_.y.back();
    result.add({"velocity, RMS at the end", "peak", 0, last, last});
    for (auto& curve : curves_) result.curves.push_back(std::move(curve));
    result.curves.push_back({"error", "simulated", "νt / L²", "1", "RMS / peak", "1", false, rms_.x, rms_.y});
  }

 private:
  void run_checks(const Moment& moment, double diffusion) {
    double squares = 0;
    for (Eigen::Index i = 0; i < moment.state.size(); ++i) {
      const double error = moment.state.velocity(0, i) - exact_(moment.state.position(2, i), moment.time);
      squares += error * error;
    }
    if (diffusion < 0.1 * (1 - 1e-9)) first_judged_ = rms_.x.size() + 1;
    rms_.x.push_back(diffusion);
    rms_.y.push_back(std::sqrt(squares / static_cast<double>(moment.state.size())) / peak_);
  }

  void draw(const Moment& moment, double diffusion) {
    const std::string when = "νt/L² = " + std::to_string(diffusion).substr(0, 4);
    std::vector<double> sum(static_cast<std::size_t>(resolution_), 0.0), count(sum);
    for (Eigen::Index i = 0; i < moment.state.size(); ++i) {
      const double layer = moment.state.position(2, i) / scene_.particle_spacing;
      const auto k = static_cast<std::size_t>(std::clamp(layer, 0.0, resolution_ - 1.0));
      sum[k] += moment.state.velocity(0, i);
      count[k] += 1;
    }
    NamedCurve found{"velocity", when, "z / L", "1", "u / peak", "1", false, {}, {}};
    NamedCurve exact = found;
    exact.reference = true;
    for (std::size_t k = 0; k < sum.size(); ++k)
      if (count[k] > 0) {
        found.x.push_back((static_cast<double>(k) + 0.5) / resolution_);
        found.y.push_back(sum[k] / count[k] / peak_);
      }
    for (int k = 0; k <= 50; ++k) {
      exact.x.push_back(k / 50.0);
      exact.y.push_back(exact_(k / 50.0 * length_, moment.time) / peak_);
    }
    curves_.push_back(std::move(exact));
    curves_.push_back(std::move(found));
  }

  const Scene& scene_;
  int resolution_;
  double length_, peak_;
  std::function<double(double z, double t)> exact_;
  Curve rms_;
  std::size_t first_judged_ = 0, drawn_ = 0;
  std::vector<NamedCurve> curves_;
};

/// Axes by second moments, <x²> = a²/4 in an ellipse, against those of the ideal drop.
class Drop : public Observer {
 public:
  explicit Drop(const Inputs& inputs)
      : scene_(inputs.scene), stretching_(inputs.scene.fills.at(0).velocity_gradient(2, 2)) {}

  void sample(const Moment& moment) override {
    const auto axis = [&](int a) {
      const auto x = moment.state.position.row(a).array();
      return 2 * std::sqrt((x - x.mean()).square().mean());
    };
    const double a = axis(0), b = axis(2);
    if (moment.time == 0) radius_ = std::sqrt(a * b);
    const auto z = moment.state.position.row(2).array();
    time_.push_back(moment.time);
    long_.push_back(b / radius_);
    short_.push_back(a / radius_);
    extent_.push_back((0.5 * (z.maxCoeff() - z.minCoeff()) + 0.5 * scene_.particle_spacing) / radius_);
  }

  void finish(Result& result) override {
    const Curve b{time_, long_}, a{time_, short_};
    for (const double t : {0.0008, 0.0038, 0.0076}) {
      const double exact = drop_axis(stretching_, t), found = value_at(b, t);
      result.add(
          {"b at t = " + std::to_string(t).substr(0, 6) + " s", "R", exact, found, std::abs(found / exact - 1), 0.03});
    }
    const double product = long_.back() * short_.back();
    result.add({"a·b at the end", "R²", 1, product, std::abs(product - 1)});
    NamedCurve exact{"axes", "b, exact", "t", "s", "semi-axis / R", "1", true, {}, {}};
    NamedCurve other = exact;
    other.name = "a, exact";
    for (int k = 0; k <= 40; ++k) {
      const double t = time_.back() * k / 40;
      exact.x.push_back(t);
      exact.y.push_back(drop_axis(stretching_, t));
      other.x.push_back(t);
      other.y.push_back(1 / exact.y.back());
    }
    result.curves.push_back(std::move(exact));
    result.curves.push_back(std::move(other));
    const auto simulated = [&](const char* name, const std::vector<double>& y) {
      result.curves.push_back({"axes", name, "t", "s", "semi-axis / R", "1", false, time_, y});
    };
    simulated("b", long_);
    simulated("a", short_);
    simulated("b, outermost particles", extent_);
  }

 private:
  const Scene& scene_;
  double stretching_, radius_ = 1;
  std::vector<double> time_, long_, short_, extent_;
};

}  // namespace

std::unique_ptr<Observer> observe_couette(const Inputs& inputs) {
  const Scene& scene = inputs.scene;
  double V = 0;
  for (const auto& plate : scene.containers) V += plate.surface_velocity.x();
  const double nu = scene.fluid.viscosity / scene.fluid.rest_density, L = inputs.resolution * scene.particle_spacing;
  return std::make_unique<Channel>(inputs, V, [=](double z, double t) { return couette_velocity(V, nu, L, z, t); });
}

std::unique_ptr<Observer> observe_poiseuille(const Inputs& inputs) {
  const Scene& scene = inputs.scene;
  const double F = scene.gravity.x(), nu = scene.fluid.viscosity / scene.fluid.rest_density,
               L = inputs.resolution * scene.particle_spacing;
  return std::make_unique<Channel>(inputs, F * L * L / (8 * nu),
                                   [=](double z, double t) { return poiseuille_velocity(F, nu, L, z, t); });
}

std::unique_ptr<Observer> observe_drop(const Inputs& inputs) { return std::make_unique<Drop>(inputs); }

}  // namespace decant::validate
