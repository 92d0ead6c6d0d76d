/// \file
/// A scene small enough to pour in milliseconds and a solver that needs no neighbors, for tests of
/// everything around a solver.
#pragma once

#include "oracle/backend.hpp"
#include "reference/scene.hpp"
#include "reference/shapes.hpp"
#include "reference/state.hpp"

#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>

namespace decant::test {

/// A tilting cup, a fixed one, and a block of fluid above the fixed one.
inline Scene falling_points_scene(int frames = 12) {
  Scene scene;
  scene.name = "falling-points";
  scene.particle_spacing = 0.01;
  scene.domain = {Vec3(-1, -1, -1), Vec3(1, 1, 1), {false, false, false}};
  Container source{"source", cup_shape(0.05, 0.1, 0.04), Vec3(-0.3, 0, 0.3), 0.04, {}};
  source.tilt = Tilt{Vec3(-0.2, 0, 0.4), Vec3::UnitY(), {{0.0, 0.0}, {0.2, 1.5}}};
  scene.containers.push_back(source);
  scene.containers.push_back({"receiver", cup_shape(0.1, 0.1, 0.04), Vec3(0, 0, 0), 0.04, {}});
  Fill block;
  block.box = SolidBox{Vec3(-0.03, -0.03, 0.15), Vec3(0.03, 0.03, 0.2)};
  scene.fills.push_back(block);
  scene.schedule.end = 0.3;
  scene.schedule.frames = frames;
  scene.schedule.substeps_per_frame = 5;
  scene.schedule.max_speed = 3.0;
  return scene;
}

/// Free fall that bounces off z = 2 cm. Every bounce mixes the state's last bits into what follows,
/// so a state that is not restored exactly shows.
class FallingPoints : public Backend {
 public:
  BackendInfo info() const override { return info_; }
  void load(const Scene& scene, const Walls&, const ParticleState& state) override {
    scene_ = scene;
    state_ = state;
  }
  Status evaluate(Fields& out, const StageInputs*) override {
    out.density = 1000.0 + 10.0 * state_.position.row(2).transpose().array();
    out.pressure = out.density.array().square();
    return {};
  }
  Status advance(int substeps) override {
    if (before_advance) before_advance(state_.substep);
    const double dt = scene_.time_step();
    for (int s = 0; s < substeps; ++s) {
      state_.velocity.colwise() += dt * scene_.gravity;
      state_.position += dt * state_.velocity;
      for (Eigen::Index i = 0; i < state_.size(); ++i) {
        if (state_.position(2, i) >= 0.02) continue;
        state_.velocity(2, i) = -state_.velocity(2, i) * 0.7;
        state_.position(2, i) = 0.04 - state_.position(2, i);
        state_.velocity(0, i) += 0.01 * std::sin(1e7 * state_.position(2, i));
      }
      ++state_.substep;
      if (state_.substep == trouble_at) return {Status::non_finite, 3, state_.substep};
    }
    calls_ += substeps;
    return {};
  }
  void read(ParticleState& out) const override { out = state_; }
  StageTimes stage_times() const override {
    StageTimes times;
    times.integrate = {1e-6 * static_cast<double>(calls_), calls_};
    return times;
  }
  NeighborStats neighbor_stats() const override { return {}; }

  BackendInfo info_{"falling", "", "host", "1 CPU core", "fp64"};
  std::function<void(std::int64_t substep)> before_advance;
  std::int64_t trouble_at = -1;

 protected:
  Scene scene_;
  ParticleState state_;

 private:
  std::int64_t calls_ = 0;
};

}  // namespace decant::test
