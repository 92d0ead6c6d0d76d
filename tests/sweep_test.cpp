/// \file
/// How near, how far and how fast containers get, against what dense times and places show.
#include "reference/sweep.hpp"

#include "reference/distance.hpp"
#include "reference/pose.hpp"
#include "reference/sampling.hpp"
#include "reference/shapes.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <limits>
#include <numbers>

namespace decant {
namespace {

Container cup_at(const Vec3& origin) { return {"cup", cup_shape(0.02, 0.03, 0.009), origin, 0.009, {}}; }

// Drawn by rapidcheck, inside a property.
double real(double low, double high) { return low + (high - low) * *rc::gen::inRange(0, 1001) / 1000.0; }
bool coin() { return *rc::gen::arbitrary<bool>(); }

/// The least distance over dense surfaces and many times: never below the true one.
double sampled_approach(const Container& a, const Container& b, double end, double spacing) {
  const Eigen::Matrix3Xd vertex = render_surface(a, spacing).vertex;
  const SolidDistance solid(b);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= 250; ++k) {
    const Pose pose_a = pose_at(a, end * k / 250), pose_b = pose_at(b, end * k / 250);
    for (Eigen::Index i = 0; i < vertex.cols(); ++i)
      least = std::min(least, solid.at(pose_b.to_local(pose_a.to_world(vertex.col(i)))).distance);
  }
  return least;
}

TEST(ClosestApproach, IsNeverMoreThanItsSlackAboveWhatSamplingFinds) {
  EXPECT_TRUE(rc::check("branch and bound against sampling", [] {
    Container a = cup_at({real(-0.1, 0.1), real(-0.05, 0.05), real(0, 0.1)});
    Container b = cup_at({0.05, 0, 0.05});
    if (coin()) b.shape = tank_shape({0.05, 0.03, 0.04}, 0.01, {{{true, false}, {}, {}}});
    for (Container* c : {&a, &b}) {
      if (coin()) {
        c->tilt = Tilt{{real(-0.1, 0.1), 0, 0.05},
                       Vec3(real(0, 1), 1, 0).normalized(),
                       {{0.1, real(-1, 1)}, {0.5, real(-3, 3)}, {1.2, real(-3, 3)}}};
        if (coin()) c->tilt->keys.resize(1), c->tilt->rate = real(-8, 8);
      }
      if (coin()) {
        auto& t = c->translation.emplace();
        if (coin()) t.keys.push_back({real(0.2, 0.8), {real(-0.1, 0.1), real(-0.1, 0.1), 0}});
        if (coin()) t.velocity = {0, real(-0.1, 0.1), real(-0.1, 0.1)};
        if (coin()) t.oscillation = {Vec3(real(-0.05, 0.05), 0, 0.02), real(0.3, 2), real(0, 6)};
      }
    }
    const double slack = 1e-3, end = 1.0;
    // Sampled points are true ones, so the least distance is not above theirs; and it is not below
    // by more than their spacing and the way between two times.
    const double sampled = std::min(sampled_approach(a, b, end, 0.012), sampled_approach(b, a, end, 0.012));
    const double found = closest_approach(a, b, end, 1.0, slack).distance;
    RC_ASSERT(found <= sampled + slack);
    RC_ASSERT(found >= sampled - 0.035);
  }));
}

TEST(FarthestAlong, IsNeverShortOfWhatDenseTimesFind) {
  const Tilt tilt{{-0.0385, 0, 0.129}, Vec3::UnitY(), {{0.2, 0}, {2.5, 7 * std::numbers::pi / 12}}};
  const Container source{"source", cup_shape(0.035, 0.09, 0.009), {-0.0735, 0, 0.039}, 0.009, tilt};
  const Eigen::Matrix3Xd vertex = render_surface(source, 0.002).vertex;
  for (int axis = 0; axis < 3; ++axis)
    for (double side : {-1.0, 1.0}) {
      const Vec3 direction = side * Vec3::Unit(axis);
      double sampled = -1;
      for (int k = 0; k <= 300; ++k) {
        const Pose pose = pose_at(source, 3.4 * k / 300);
        for (Eigen::Index i = 0; i < vertex.cols(); ++i)
          sampled = std::max(sampled, direction.dot(pose.to_world(vertex.col(i))));
      }
      EXPECT_NEAR(farthest_along(direction, solid_rings(source), &source, 3.4), sampled, 1e-4);
    }
}

TEST(FarthestAlong, AndFastestPointBoundAnyMotion) {
  EXPECT_TRUE(rc::check("never short of what dense times find", [] {
    Container c = cup_at({0.1, 0, 0.05});
    if (coin()) {
      c.tilt = Tilt{{real(-0.1, 0.1), 0, 0.05}, Vec3::UnitY(), {{0.1, real(-1, 1)}}};
      if (coin()) c.tilt->keys.push_back({0.6, real(-3, 3)});
      if (coin()) c.tilt->rate = real(-20, 20);
      if (coin()) c.tilt->oscillation = {real(-1, 1), real(0.5, 3), real(0, 6)};
    }
    auto& t = c.translation.emplace();
    if (coin()) t.keys.push_back({real(0.2, 1.5), {real(-1, 1), real(-1, 1), 0}});
    if (coin()) t.velocity = {0, real(-1, 1), real(-1, 1)};
    if (coin()) t.oscillation = {Vec3(real(-1, 1), 0, 0.2), real(0.3, 2), real(0, 6)};
    const auto rings = solid_rings(c);
    const double fastest = fastest_point(rings, c);
    const Vec3 directions[] = {{0, 0.6, -0.8}, {1, 0, 0}};
    const double farthest[] = {farthest_along(directions[0], rings, &c, 1.0),
                               farthest_along(directions[1], rings, &c, 1.0)};
    const Eigen::Matrix3Xd vertex = render_surface(c, 0.02).vertex;
    for (int k = 0; k <= 200; ++k) {
      const Pose pose = pose_at(c, 0.005 * k);
      for (Eigen::Index i = 0; i < vertex.cols(); ++i) {
        const Vec3 x = pose.to_world(vertex.col(i));
        RC_ASSERT(pose.velocity_at(x).norm() <= fastest * (1 + 1e-9) + 1e-12);
        for (int d = 0; d < 2; ++d) RC_ASSERT(directions[d].dot(x) <= farthest[d] + 1e-5);
      }
    }
  }));
}

TEST(FastestPoint, OfAPistonIsThreeHalvesOfItsMeanSpeed) {
  Container piston = cup_at(Vec3::Zero());
  piston.translation.emplace().keys = {{1, Vec3::Zero()}, {3, Vec3(0, 3, 4)}};
  EXPECT_DOUBLE_EQ(fastest_point(solid_rings(piston), piston), 1.5 * 5 / 2);
  piston.translation->oscillation = {Vec3(0.3, 0, 0.4), 2};
  EXPECT_DOUBLE_EQ(fastest_point(solid_rings(piston), piston), 1.5 * 5 / 2 + 2 * std::numbers::pi * 2 * 0.5);
}

}  // namespace
}  // namespace decant
