/// \file
/// Signed distance and outward normal of cups and tanks: by hand, and against points laid densely
/// on the surface and a sign that is found another way.
#include "reference/distance.hpp"
#include "tests/generators.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <string>

namespace decant::test {
namespace {

constexpr double pi = std::numbers::pi;

Container container(const std::variant<RevolvedShape, BoxShape>& shape) {
  return {"it", shape, Vec3::Zero(), 0.02, {}};
}

/// Inner radius 5 cm, inner height 10 cm, walls 2 cm.
Container cup() { return container(cup_shape(0.05, 0.1, 0.02)); }

/// Walls that lean outward and end in a ridge.
Container funnel_cup() {
  return container(
      RevolvedShape{{{0, -0.02}, {0.04, -0.02}, {0.09, 0.08}, {0.08, 0.1}, {0.05, 0.03}, {0.03, 0}, {0, 0.01}}});
}

/// Cavity 20 × 10 × 30 cm, walls 2 cm, open above.
Container tank() { return container(tank_shape(Vec3(0.2, 0.1, 0.3), 0.02, {{{}, {}, {false, true}}})); }

/// A slab below the plane z = 0 without end in x and y.
Container endless_floor() {
  BoxShape slab = tank_shape(Vec3(0.2, 0.1, 0.3), 0.02, {{{true, true}, {true, true}, {false, true}}});
  slab.endless = {true, true, false};
  return container(slab);
}

struct Case {
  Vec3 point;
  double distance;
  Vec3 normal;
};

void expect(const Container& solid, const std::vector<Case>& cases) {
  for (const Case& c : cases) {
    const SurfaceDistance found = signed_distance(solid, c.point);
    EXPECT_NEAR(found.distance, c.distance, 1e-15) << c.point.transpose();
    EXPECT_LT((found.normal - c.normal).norm(), 1e-12) << c.point.transpose() << ": " << found.normal.transpose();
  }
}

TEST(CupDistance, IsAsMeasuredByHandOnEveryMeridian) {
  const std::vector<Case> at_y_zero = {
      {{0.01, 0, 0.01}, 0.01, {0, 0, 1}},            // above the bottom
      {{0.045, 0, 0.05}, 0.005, {-1, 0, 0}},         // beside the wall
      {{0.046, 0, 0.003}, 0.003, {0, 0, 1}},         // in the corner, nearer the bottom
      {{0.048, 0, 0.003}, 0.002, {-1, 0, 0}},        // in the corner, nearer the wall
      {{0.01, 0, -0.005}, -0.005, {0, 0, 1}},        // inside the bottom, upper half
      {{0.01, 0, -0.016}, -0.004, {0, 0, -1}},       // inside the bottom, lower half
      {{0.053, 0, 0.05}, -0.003, {-1, 0, 0}},        // inside the wall, inner half
      {{0.066, 0, 0.05}, -0.004, {1, 0, 0}},         // inside the wall, outer half
      {{0.053, 0, -0.004}, -0.005, {-0.6, 0, 0.8}},  // inside, nearest to the inner corner
      {{0.06, 0, 0.13}, 0.03, {0, 0, 1}},            // above the rim
      {{0.02, 0, 0.14}, 0.05, {-0.6, 0, 0.8}},       // above the mouth, nearest to the rim's edge
      {{0.073, 0, -0.024}, 0.005, {0.6, 0, -0.8}},   // outside the lower edge
      {{0.1, 0, 0.05}, 0.03, {1, 0, 0}},             // outside
      {{0.01, 0, -0.05}, 0.03, {0, 0, -1}},          // beneath
      {{0.05, 0, 0.05}, 0, {-1, 0, 0}},              // on the wall
      {{0.01, 0, 0}, 0, {0, 0, 1}}};                 // on the bottom
  for (const double angle : {0.0, 1.0, pi / 2, 4.0}) {
    const Eigen::AngleAxisd turn(angle, Vec3::UnitZ());
    std::vector<Case> turned;
    for (const Case& c : at_y_zero) turned.push_back({turn * c.point, c.distance, turn * c.normal});
    // On a surface itself the turned point is off by rounding, and either side of it is right.
    if (angle != 0) turned.resize(turned.size() - 2);
    expect(cup(), turned);
  }
}

TEST(CupDistance, TakesTheMeridianOfXOnTheAxis) {
  expect(cup(), {{{0, 0, 0.01}, 0.01, {0, 0, 1}},
                 {{0, 0, -0.05}, 0.03, {0, 0, -1}},
                 {{0, 0, 0.08}, 0.05, {-1, 0, 0}},
                 {{0, 0, 0.22}, 0.13, {-5.0 / 13, 0, 12.0 / 13}}});
}

TEST(TankDistance, IsAsMeasuredByHand) {
  expect(tank(), {{{0.1, 0.05, 0.01}, 0.01, {0, 0, 1}},                          // above the bottom
                  {{0.004, 0.05, 0.2}, 0.004, {1, 0, 0}},                        // beside the low x wall
                  {{0.1, 0.097, 0.2}, 0.003, {0, -1, 0}},                        // beside the high y wall
                  {{0.002, 0.003, 0.004}, 0.002, {1, 0, 0}},                     // in the corner
                  {{0.1, 0.05, -0.005}, -0.005, {0, 0, 1}},                      // inside the bottom
                  {{-0.006, 0.05, 0.1}, -0.006, {1, 0, 0}},                      // inside a wall, inner half
                  {{-0.018, 0.05, 0.1}, -0.002, {-1, 0, 0}},                     // inside a wall, outer half
                  {{-0.002, -0.003, -0.006}, -0.007, {2 / 7., 3 / 7., 6 / 7.}},  // in the corner's solid
                  {{-0.01, 0.05, 0.34}, 0.04, {0, 0, 1}},                        // above the rim
                  {{0.1, 0.05, 0.42}, 0.13, {0, 5. / 13, 12. / 13}},             // above the mouth, low y first
                  {{0.1, 0.05, -0.05}, 0.03, {0, 0, -1}},                        // beneath
                  {{0.22 + 0.002, 0.12 + 0.003, -0.026}, 0.007, {2 / 7., 3 / 7., -6 / 7.}},  // outside
                  {{0, 0.05, 0.1}, 0, {1, 0, 0}}});                                          // on a wall
}

TEST(EndlessFloor, HasNoSurfaceWhereThePeriodCutsIt) {
  expect(endless_floor(), {{{0.001, 0.001, -0.008}, -0.008, {0, 0, 1}},
                           {{0.199, 0.05, -0.008}, -0.008, {0, 0, 1}},
                           {{0.001, 0.099, -0.015}, -0.005, {0, 0, -1}},
                           {{0, 0, 0.03}, 0.03, {0, 0, 1}}});
}

/// True inside a revolved solid: its outline winds about the point.
bool inside(const RevolvedShape& shape, const Vec3& x) {
  const Eigen::Vector2d p(std::hypot(x.x(), x.y()), x.z());
  double turned = 0;
  for (std::size_t k = 0; k < shape.profile.size(); ++k) {
    const auto &from = shape.profile[k], &to = shape.profile[(k + 1) % shape.profile.size()];
    const Eigen::Vector2d a = Eigen::Vector2d(from[0], from[1]) - p, b = Eigen::Vector2d(to[0], to[1]) - p;
    turned += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  return turned > pi;
}

bool inside(const BoxShape& shape, const Vec3& x) {
  bool found = false;
  for (const auto& b : shape.solid) found = found || ((x - b.min).minCoeff() >= 0 && (b.max - x).minCoeff() >= 0);
  return found;
}

bool inside(const Container& c, const Vec3& x) {
  return std::visit([&](const auto& shape) { return inside(shape, x); }, c.shape);
}

/// Points at most `gap` apart on all of the surface, as rings.
std::vector<Vec3> surface_points(const RevolvedShape& shape, double gap) {
  std::vector<Vec3> points;
  for (std::size_t k = 0; k < shape.profile.size(); ++k) {
    const auto &a = shape.profile[k], &b = shape.profile[(k + 1) % shape.profile.size()];
    if (a[0] == 0 && b[0] == 0) continue;
    const int steps = static_cast<int>(std::hypot(b[0] - a[0], b[1] - a[1]) / gap) + 1;
    for (int s = 0; s <= steps; ++s) {
      const double r = a[0] + (b[0] - a[0]) * s / steps, z = a[1] + (b[1] - a[1]) * s / steps;
      const int around = static_cast<int>(2 * pi * r / gap) + 1;
      for (int n = 0; n < around; ++n)
        points.emplace_back(r * std::cos(2 * pi * n / around), r * std::sin(2 * pi * n / around), z);
    }
  }
  return points;
}

/// Points at most `gap` apart on the boxes' faces, where one side is solid and the other is not.
std::vector<Vec3> surface_points(const BoxShape& shape, double gap) {
  std::vector<Vec3> points;
  for (const auto& box : shape.solid)
    for (int a = 0; a < 3; ++a)
      for (const double plane : {box.min[a], box.max[a]}) {
        const int u = (a + 1) % 3, v = (a + 2) % 3;
        const Vec3 size = box.max - box.min;
        const int nu = static_cast<int>(size[u] / gap) + 1, nv = static_cast<int>(size[v] / gap) + 1;
        for (int i = 0; i < nu; ++i)
          for (int j = 0; j < nv; ++j) {
            Vec3 x = box.min;
            x[a] = plane;
            x[u] += size[u] * (i + 0.5) / nu;
            x[v] += size[v] * (j + 0.5) / nv;
            const Vec3 aside = 1e-9 * Vec3::Unit(a);
            if (inside(shape, x + aside) != inside(shape, x - aside)) points.push_back(x);
          }
      }
  return points;
}

class EverySolid : public testing::TestWithParam<const char*> {
 protected:
  Container solid_ = GetParam() == std::string("Cup")    ? cup()
                     : GetParam() == std::string("Tank") ? tank()
                                                         : funnel_cup();
};
INSTANTIATE_TEST_SUITE_P(All, EverySolid, testing::Values("Cup", "FunnelCup", "Tank"),
                         [](const auto& solid) { return std::string(solid.param); });

TEST_P(EverySolid, IsAsFarAsTheNearestOfDenseSurfacePoints) {
  const double gap = 0.002;
  const auto surface = std::visit([&](const auto& shape) { return surface_points(shape, gap); }, solid_.shape);
  const Eigen::Matrix3Xd points = cloud(3, 300, -0.1, 0.25);
  for (const auto& x : points.colwise()) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& s : surface) nearest = std::min(nearest, (x - s).norm());
    const double found = std::abs(signed_distance(solid_, x).distance);
    EXPECT_LE(found, nearest + 1e-12) << x.transpose();
    EXPECT_GE(found, nearest - gap) << x.transpose();
  }
}

TEST_P(EverySolid, IsNegativeInsideAndPositiveOutside) {
  const Eigen::Matrix3Xd points = cloud(4, 3000, -0.1, 0.25);
  int in = 0;
  for (const auto& x : points.colwise()) {
    EXPECT_EQ(signed_distance(solid_, x).distance < 0, inside(solid_, x)) << x.transpose();
    in += inside(solid_, x);
  }
  EXPECT_GT(in, 20);
}

TEST_P(EverySolid, HasAUnitNormalAlongTheWayFromItsNearestSurfacePoint) {
  const SolidDistance solid(solid_);
  const Eigen::Matrix3Xd points = cloud(5, 3000, -0.1, 0.25);
  for (const auto& x : points.colwise()) {
    const auto [distance, normal] = solid.at(x);
    EXPECT_NEAR(normal.norm(), 1, 1e-12) << x.transpose();
    EXPECT_NEAR(solid.at(x - distance * normal).distance, 0, 1e-14) << x.transpose();
    EXPECT_NEAR(solid.at(x - 0.4 * distance * normal).distance, 0.6 * distance, 1e-14) << x.transpose();
  }
}

TEST_P(EverySolid, IsNeverNearerThanItsBoundingBoxAllows) {
  const SolidDistance solid(solid_);
  const Eigen::Matrix3Xd points = cloud(6, 3000, -0.3, 0.5);
  for (const double reach : {0.001, 0.01, 0.1}) {
    int far = 0;
    for (const auto& x : points.colwise()) {
      far += !solid.may_be_within(reach, x);
      EXPECT_TRUE(solid.may_be_within(reach, x) || solid.at(x).distance >= reach) << x.transpose();
    }
    EXPECT_GT(far, 100) << reach;
  }
}

/// The answers beside edges, inside and out, at the surface and far from it.
TEST_P(EverySolid, GivesTheSameBitsToQuestionsCloseToOnePlace) {
  const SolidDistance solid(solid_);
  const Eigen::Matrix3Xd points = cloud(7, 600, -0.1, 0.25), ways = cloud(8, 600, -1, 1);
  for (const double radius : {1e-9, 1e-5, 0.003, 0.05})
    for (Eigen::Index k = 0; k < points.cols(); ++k)
      for (const bool at_surface : {false, true}) {
        Vec3 around = points.col(k);
        if (at_surface) around -= solid.at(around).distance * solid.at(around).normal;
        const SolidDistance::Nearby nearby = solid.nearby(around, solid.at(around).distance, radius);
        for (Eigen::Index j = 0; j < 8; ++j) {
          const Vec3 way = ways.col((7 * k + j) % ways.cols());
          const Vec3 local = around + (j == 0 ? 0 : radius / way.norm()) * way;
          const SurfaceDistance expected = solid.at(local), got = nearby.at(local);
          ASSERT_EQ(got.distance, expected.distance) << local.transpose() << ", radius " << radius;
          ASSERT_EQ(got.normal, expected.normal) << local.transpose() << ", radius " << radius;
        }
      }
}

TEST(Cavity, IsTheRoomForFluidAndNothingElse) {
  for (const Vec3& x : {Vec3(0, 0, 0.01), Vec3(0.049, 0, 0.099), Vec3(-0.03, 0.03, 0.05)})
    EXPECT_TRUE(in_cavity(cup(), x)) << x.transpose();
  for (const Vec3& x : {Vec3(0, 0, 0.11), Vec3(0.06, 0, 0.05), Vec3(0, 0, -0.01), Vec3(0, 0, -0.05), Vec3(0.1, 0, 0.05),
                        Vec3(0.06, 0, 0.12)})
    EXPECT_FALSE(in_cavity(cup(), x)) << x.transpose();
  for (const Vec3& x : {Vec3(0.1, 0.05, 0.01), Vec3(0.001, 0.099, 0.299)})
    EXPECT_TRUE(in_cavity(tank(), x)) << x.transpose();
  for (const Vec3& x : {Vec3(0.1, 0.05, 0.31), Vec3(-0.01, 0.05, 0.1), Vec3(0.1, 0.05, -0.01), Vec3(0.1, 0.05, -0.05),
                        Vec3(0.3, 0.05, 0.1)})
    EXPECT_FALSE(in_cavity(tank(), x)) << x.transpose();
}

}  // namespace
}  // namespace decant::test
