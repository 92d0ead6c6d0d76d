/// \file
/// What properties draw: numbers whose last bits are in use, vectors, clouds of points; and the
/// wall-less scene that most of them are set in.
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <rapidcheck.h>

#include <cstdint>
#include <random>

namespace decant::test {

/// A real from low to high whose last bits are in use.
inline double real(double low, double high) {
  const auto k = *rc::gen::resize(100, rc::gen::inRange<std::int64_t>(0, std::int64_t{1} << 53));
  return low + (high - low) * static_cast<double>(k) * 0x1p-53;
}

inline int integer(int low, int high) { return *rc::gen::inRange(low, high + 1); }
inline bool coin() { return *rc::gen::arbitrary<bool>(); }
inline Vec3 vec(double low, double high) { return {real(low, high), real(low, high), real(low, high)}; }

/// n points, uniform in low … high on each axis; the same for the same seed on every machine.
inline Eigen::Matrix3Xd cloud(int seed, int n, double low, double high) {
  std::mt19937_64 random(static_cast<std::uint64_t>(seed));
  Eigen::Matrix3Xd points(3, n);
  for (double& x : points.reshaped()) x = low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  return points;
}

/// A cloud of drawn seed.
inline Eigen::Matrix3Xd any_cloud(int n, double low, double high) { return cloud(integer(0, 1 << 30), n, low, high); }

/// H = 2 cm, dt = 1/1024 s, nothing but room.
inline Scene open_scene(KernelFamily family = KernelFamily::cubic_spline) {
  Scene scene;
  scene.name = "open";
  scene.particle_spacing = 0.01;
  scene.kernel = family;
  scene.domain = {Vec3::Constant(-1), Vec3::Constant(1), {false, false, false}};
  scene.schedule.end = 1;
  scene.schedule.frames = 1024;
  scene.schedule.substeps_per_frame = 1;
  return scene;
}

inline ParticleState state_of(const Eigen::Matrix3Xd& position, const Eigen::Matrix3Xd& velocity) {
  ParticleState state;
  state.position = position;
  state.velocity = velocity;
  return state;
}

}  // namespace decant::test
