// A solver as anybody might have one: reference/README.md in fp32, every particle with every other.
#pragma once

#include "oracle/plugin.h"

#include <Eigen/Dense>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

using Vec = Eigen::Vector3f;

struct WallMotion {
  Eigen::Matrix3f rotation;
  Vec translation, pivot, angular, linear;

  explicit WallMotion(const decant_pose& p)
      : rotation(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(p.rotation).cast<float>()),
        translation(vec(p.translation)),
        pivot(vec(p.pivot)),
        angular(vec(p.angular_velocity)),
        linear(vec(p.linear_velocity) + vec(p.surface_velocity)) {}
  static Vec vec(const double* v) { return Eigen::Map<const Eigen::Vector3d>(v).cast<float>(); }
  Vec velocity_at(const Vec& x) const { return linear + angular.cross(x - pivot); }
};

struct AllPairs {
  static constexpr std::uint32_t offers = 0x1FF;  // all but lists
  decant_scene s{};
  float H = 0, h = 0, m = 0;
  std::vector<Vec> x, v, wall_local, wall_x, wall_v;
  std::vector<int> container;
  std::vector<float> volume, density, pressure;
  struct Parts {
    Vec pressure = Vec::Zero(), viscous = Vec::Zero(), wall_pressure = Vec::Zero(), wall_viscous = Vec::Zero();
  };
  std::vector<Parts> parts;
  std::vector<std::int64_t> fluid_count, fluid_sum, wall_count, wall_sum;
  std::int64_t substep = 0;

  float W(float r) const {
    const float q = r / h, u = std::fmax(0.0f, 2 - q), unit = 1 / (std::numbers::pi_v<float> * h * h * h);
    if (s.kernel == DECANT_MUELLER_2003) return 315.0f / 512 * unit * std::pow(std::fmax(0.0f, 1 - q * q / 4), 3.0f);
    if (s.kernel == DECANT_WENDLAND_C2) return 21.0f / 256 * unit * u * u * u * u * (2 * q + 1);
    return unit * (q < 1 ? 1 - q * q * (1.5f - 0.75f * q) : 0.25f * u * u * u);
  }
  float G(float r) const {
    const float q = r / h, u = std::fmax(0.0f, 2 - q), unit = 1 / (std::numbers::pi_v<float> * h * h * h * h * h);
    if (s.kernel == DECANT_MUELLER_2003) return q > 0 ? 45.0f / 64 * unit * u * u / q : 0;
    if (s.kernel == DECANT_WENDLAND_C2) return 105.0f / 128 * unit * u * u * u;
    return unit * (q < 1 ? 3 - 2.25f * q : 0.75f * u * u / q);
  }
  float L(float r) const {
    if (s.kernel != DECANT_MUELLER_2003) return 2 * r * r * G(r) / (r * r + 0.01f * h * h);
    return 45.0f / 64 / (std::numbers::pi_v<float> * h * h * h * h * h) * std::fmax(0.0f, 2 - r / h);
  }
  float pressure_at(float rho) const {
    const double p = s.eos_stiffness * (std::pow(rho / s.rest_density, s.eos_exponent) - 1);
    return static_cast<float>(s.allow_tension ? p : std::fmax(p, 0.0));
  }
  float period(int axis) const { return static_cast<float>(s.domain_max[axis] - s.domain_min[axis]); }

  /// visit(j, x_i − x_j, r) for all within H.
  template <class Visit>
  void near(const Vec& xi, const std::vector<Vec>& all, Visit visit) const {
    for (std::size_t j = 0; j < all.size(); ++j) {
      Vec d = xi - all[j];
      for (int a = 0; a < 3; ++a)
        if (s.periodic[a]) d[a] -= period(a) * std::rint(d[a] / period(a));
      if (d.squaredNorm() < H * H) visit(j, d, d.norm());
    }
  }

  void find_volumes() {
    volume.assign(wall_local.size(), 0);
    for (std::size_t b = 0; b < volume.size(); ++b) {
      float sum = 0;
      near(wall_local[b], wall_local, [&](std::size_t k, const Vec&, float r) {
        if (container[k] == container[b]) sum += W(r);
      });
      volume[b] = 1 / sum;
    }
  }
  std::vector<WallMotion> motions(std::int64_t after) const {
    std::vector<WallMotion> all;
    for (int k = 0; k < s.containers; ++k) {
      decant_pose pose;
      s.pose(s.host, k, static_cast<double>(after) * s.time_step, &pose);
      all.emplace_back(pose);
    }
    return all;
  }
  void place_walls() {
    const auto walls = motions(substep);
    wall_x.resize(volume.size()), wall_v.resize(volume.size());
    for (std::size_t b = 0; b < volume.size(); ++b) {
      const WallMotion& wall = walls[static_cast<std::size_t>(container[b])];
      wall_x[b] = wall.rotation * wall_local[b] + wall.translation;
      wall_v[b] = wall.velocity_at(wall_x[b]);
    }
  }
  void resize_fields() {
    density.assign(x.size(), m * W(0)), pressure.resize(x.size());
    for (auto* counts : {&fluid_count, &fluid_sum, &wall_count, &wall_sum}) counts->assign(x.size(), 0);
  }
  void find_densities() {
    place_walls(), resize_fields();
    for (std::size_t i = 0; i < x.size(); ++i) {
      near(x[i], x, [&](std::size_t j, const Vec&, float r) {
        if (j == i) return;
        density[i] += m * W(r), ++fluid_count[i], fluid_sum[i] += static_cast<std::int64_t>(j);
      });
      near(x[i], wall_x, [&](std::size_t b, const Vec&, float r) {
        density[i] += static_cast<float>(s.rest_density) * volume[b] * W(r);
        ++wall_count[i], wall_sum[i] += static_cast<std::int64_t>(b);
      });
      pressure[i] = pressure_at(density[i]);
    }
  }
  void find_forces() {
    const auto mu = static_cast<float>(s.viscosity), mu_w = static_cast<float>(s.wall_viscosity);
    parts.assign(x.size(), {});
    for (std::size_t i = 0; i < x.size(); ++i) {
      Parts& a = parts[i];
      const float qi = pressure[i] / (density[i] * density[i]);
      near(x[i], x, [&](std::size_t j, const Vec& d, float r) {
        if (j == i) return;
        a.pressure += m * (qi + pressure[j] / (density[j] * density[j])) * G(r) * d;
        a.viscous += mu / density[i] * m / density[j] * L(r) * (v[j] - v[i]);
      });
      near(x[i], wall_x, [&](std::size_t b, const Vec& d, float r) {
        a.wall_pressure += static_cast<float>(s.rest_density) * volume[b] * qi * G(r) * d;
        a.wall_viscous += mu_w / density[i] * volume[b] * L(r) * (wall_v[b] - v[i]);
      });
    }
  }
  /// False: there is no such option.
  bool option(const std::string&, const std::string&) { return false; }
  void loaded() {}
  const char* device_name() const { return "one thread of the host"; }
  Vec acceleration(std::size_t i) const {
    const Parts& a = parts[i];
    return a.pressure + a.viscous + a.wall_pressure + a.wall_viscous + WallMotion::vec(s.gravity);
  }
};
