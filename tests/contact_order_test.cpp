/// \file
/// Whose push comes first: it cannot matter among containers, and it does between them and the floor.
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/shapes.hpp"
#include "reference/solver.hpp"
#include "tools/fuzz/case.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace decant {
namespace {

std::vector<SolidDistance> solids_of(const Scene& scene) { return {scene.containers.begin(), scene.containers.end()}; }

/// The state after contact with the containers from the first on, and from the last.
std::array<ParticleState, 2> both_orders(Scene scene, const ParticleState& state) {
  std::array<ParticleState, 2> after = {state, state};
  for (ParticleState& s : after) {
    collide(scene, solids_of(scene), scene.time_at(state.substep), s);
    std::reverse(scene.containers.begin(), scene.containers.end());
  }
  return after;
}

/// Two blocks so far apart along x, in dx, as near as rules let them stand at H = 1.5 dx, with particles all
/// through them and the gap; contact at its longest, restitution and friction.
std::array<ParticleState, 2> between_blocks(double gap) {
  Scene scene;
  const double dx = scene.particle_spacing = 0.01;
  scene.support_ratio = 1.5;
  scene.contact = {0.5, 0.3, 0.4};
  scene.schedule = {1, 1, 1000, false, 0.4, 1.0};
  // The first is a corner, whose third face outlasts two projections.
  const BoxShape corner = tank_shape(Vec3(8, 8, 8) * dx, 2 * dx, {{{false, true}, {false, true}, {false, true}}});
  BoxShape block;
  block.cavity = {Vec3::Zero(), Vec3(2, 8, 8) * dx};
  block.solid = {block.cavity};
  scene.containers.push_back({"corner", corner, Vec3::Zero(), 2 * dx, {}});
  scene.containers.push_back({"block", block, Vec3(-4 - gap, 0, 0) * dx, 2 * dx, {}});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  ParticleState state;
  state.position.resize(3, 4000);
  state.velocity.resize(3, 4000);
  for (Eigen::Index i = 0; i < state.size(); ++i) {
    state.position.col(i) = dx * Vec3(-2 + 4 * unit(random), 2 + 5 * unit(random), 2 + 5 * unit(random));
    state.velocity.col(i) = Vec3(unit(random), unit(random), unit(random));
  }
  return both_orders(scene, state);
}

/// Containers are H ≥ 1.5 dx apart. One that pushes leaves the particle within the contact distance of its
/// surface, dx/2 at most, so that dx at least are left to any other: more than the contact distance.
TEST(OrderOfContact, OfContainersAsNearAsTheyMayBeCannotBeSeen) {
  const auto [forward, backward] = between_blocks(1.5);
  EXPECT_EQ(forward.position, backward.position);
  EXPECT_EQ(forward.velocity, backward.velocity);
}

TEST(OrderOfContact, WouldBeSeenWereTheyNearerThanTwoContactDistances) {
  const auto [forward, backward] = between_blocks(0.9);
  EXPECT_NE(forward.position, backward.position);
}

TEST(OrderOfContact, OfContainersIsNotSeenInFuzzedProblemsEither) {
  int several = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const Fixture f = fuzz::fixture_of(fuzz::random_case(seed), "fuzz");
    if (f.scene.containers.size() < 2) continue;
    ++several;
    const auto [forward, backward] = both_orders(f.scene, f.state);
    EXPECT_EQ(forward.position, backward.position) << seed;
    EXPECT_EQ(forward.velocity, backward.velocity) << seed;
  }
  EXPECT_GT(several, 30);
}

/// A wall that leans over the floor pushes down and out, the floor up: last, so that nothing stays below it.
TEST(OrderOfContact, OfTheFloorIsLast) {
  Scene scene;
  scene.particle_spacing = 0.01;
  scene.contact = {0.5, 0, 0};
  scene.schedule = {1, 1, 1000, false, 0.4, 1.0};
  scene.floor = Floor{0};
  // A cone on its tip's stub: the wall goes out and up at 45°.
  scene.containers.push_back(
      {"cone", RevolvedShape{{{0, 0}, {0.05, 0}, {0.15, 0.1}, {0, 0.1}}}, Vec3::Zero(), 0.02, {}});
  ParticleState state;
  state.position = Vec3(0.052, 0, 0.0001);
  state.velocity = Vec3::Zero();
  collide(scene, solids_of(scene), 0, state);
  // From the slant along its normal (1, 0, −1)/√2 to 5 mm from it, then straight up to 5 mm.
  const double distance = (0.052 - 0.05 - 0.0001) / std::sqrt(2.0);
  EXPECT_NEAR(state.position(0, 0), 0.052 + (0.005 - distance) / std::sqrt(2.0), 1e-12);
  EXPECT_DOUBLE_EQ(state.position(2, 0), 0.005);
}

}  // namespace
}  // namespace decant
