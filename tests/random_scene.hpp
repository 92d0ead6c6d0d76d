/// \file
/// Random small scenes and states for property tests: every kernel, with and without walls, on free
/// and periodic axes, far from the origin too.
#pragma once

#include "oracle/solution/fixture.hpp"
#include "reference/sampling.hpp"
#include "reference/shapes.hpp"

#include <random>

namespace decant::test {

/// A state that no pour would show: a jittered lattice with random velocities in a box tank or in
/// the open. The same seed gives the same fixture (without recorded fields, and without a file).
inline Fixture random_fixture(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto real = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto chance = [&](double p) { return real(0, 1) < p; };
  const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };

  Fixture f;
  f.name = "random-" + std::to_string(seed);
  f.phase = "random";
  Scene& scene = f.scene;
  scene.name = f.name;
  const double dx = scene.particle_spacing = real(0.002, 0.02);
  scene.kernel = static_cast<KernelFamily>(pick(3));
  scene.support_ratio = real(1.8, 2.8);
  scene.fluid.allow_tension = chance(0.5);
  scene.fluid.eos_exponent = chance(0.5) ? 7 : 1;
  scene.fluid.viscosity = chance(0.2) ? 0 : real(0.001, 0.5);
  scene.fluid.wall_viscosity = 2 * scene.fluid.viscosity;
  scene.contact.friction = chance(0.5) ? 0 : real(0, 1);
  scene.contact.restitution = chance(0.5) ? 0 : real(0, 1);
  scene.schedule = {1, 10, 1000, true, 0.4, {}};

  const int cells[3] = {5 + pick(5), 5 + pick(5), 5 + pick(5)};
  const Vec3 size = dx * Vec3(cells[0], cells[1], cells[2]);
  const Vec3 corner = chance(0.3) ? Vec3(real(-2, 2), real(-2, 2), real(-2, 2)) : Vec3::Zero();
  const bool tank = chance(0.6);
  scene.domain = {corner - 8 * dx * Vec3::Ones(), corner + size + 8 * dx * Vec3::Ones(), {}};
  OpenFaces open{};
  for (int a = 0; a < 3; ++a) {
    if (!chance(0.3)) continue;
    scene.domain.periodic[static_cast<std::size_t>(a)] = true;
    scene.domain.min[a] = corner[a];
    scene.domain.max[a] = corner[a] + size[a];
    open[static_cast<std::size_t>(a)] = {true, true};
  }
  const bool all_open = open[0][0] && open[1][0] && open[2][0];
  if (tank && !all_open) {
    BoxShape shape = tank_shape(size, 3 * dx, open);
    shape.endless = scene.domain.periodic;
    scene.containers.push_back({"tank", shape, corner, 3 * dx, {}});
  }

  const double jitter = chance(0.5) ? 0.1 : 0.45, filled = real(0.3, 1);
  std::vector<Vec3> x;
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i)
        if (chance(filled))
          x.push_back(corner + dx * (Vec3(i, j, k) + Vec3(0.5, 0.5, 0.5) +
                                     jitter * Vec3(real(-1, 1), real(-1, 1), real(-1, 1))));
  std::shuffle(x.begin(), x.end(), random);
  const auto n = static_cast<Eigen::Index>(x.size());
  f.state.position.resize(3, n);
  f.state.velocity.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    f.state.position.col(i) = x[static_cast<std::size_t>(i)];
    f.state.velocity.col(i) = Vec3(real(-1, 1), real(-1, 1), real(-1, 1));
  }
  f.state.quantise();
  if (!scene.containers.empty() && chance(0.3))
    scene.containers[0].surface_velocity = Vec3(real(-1, 1), real(-1, 1), real(-1, 1));
  // About where the tank stands, at up to a few m/s.
  if (!scene.containers.empty() && chance(0.3)) {
    Vec3 amplitude = dx * Vec3(real(-0.5, 0.5), real(-0.5, 0.5), real(-0.5, 0.5));
    for (int a = 0; a < 3; ++a)
      if (scene.domain.periodic[static_cast<std::size_t>(a)]) amplitude[a] = 0;
    scene.containers[0].translation.emplace().oscillation = {amplitude, real(0.1, 0.5) / dx, real(0, 6)};
  }
  return f;
}

}  // namespace decant::test
