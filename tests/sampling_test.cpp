/// \file
/// Where wall particles and the first fluid particles lie, how many there are, and what volume a
/// wall particle stands for.
#include "reference/sampling.hpp"
#include "reference/distance.hpp"
#include "reference/initial_state.hpp"
#include "reference/solver.hpp"
#include "tests/generators.hpp"
#include "tests/plain_kernel.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <stdexcept>

namespace decant::test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double cup_radius = 0.05, cup_height = 0.1, cup_thickness = 0.04;  // m

Scene cup_scene(double level) {
  Scene scene = open_scene();
  scene.particle_spacing = 0.005;
  scene.containers = {{"cup", cup_shape(cup_radius, cup_height, cup_thickness), Vec3(0.2, 0, 0.1), cup_thickness, {}}};
  scene.fills = {{"cup", level, {}, Vec3(1, 2, 3)}};
  return scene;
}

/// Cavity of 10 × 6 × 8 spacings, walls of six, open above. dx = 1/64 m, exact in fp32.
Scene tank_scene() {
  Scene scene = open_scene();
  const double dx = scene.particle_spacing = 1.0 / 64;
  scene.containers = {
      {"tank", tank_shape(dx * Vec3(10, 6, 8), 6 * dx, {{{}, {}, {false, true}}}), Vec3(0.25, 0.5, 0), 6 * dx, {}}};
  scene.fills = {{"tank", 5.5 * dx, {}, Vec3::Zero()}};
  return scene;
}

/// Slab of `layers` lattice layers below z = 0, endless in x and y; dx = 1/64 m.
Scene slab_scene(int layers, KernelFamily family) {
  Scene scene = open_scene(family);
  const double dx = scene.particle_spacing = 1.0 / 64;
  scene.domain = {Vec3(0, 0, -1), Vec3(8 * dx, 8 * dx, 1), {true, true, false}};
  BoxShape slab = tank_shape(dx * Vec3(8, 8, 4), layers * dx, {{{true, true}, {true, true}, {false, true}}});
  slab.endless = {true, true, false};
  scene.containers = {{"slab", slab, Vec3::Zero(), layers * dx, {}}};
  scene.wall_layers = (layers + 1) / 2;  // counted from either face, so that the slab is full
  return scene;
}

/// Depth under the cup's nearest face, counted along the axes where two faces meet, m.
double depth_in_cup(const Vec3& x) {
  const double r = std::hypot(x.x(), x.y()), z = x.z();
  const double from_cavity = std::max(r - cup_radius, -z);
  return std::min({from_cavity, cup_radius + cup_thickness - r, z + cup_thickness, cup_height - z});
}

TEST(CupWalls, LieInLayersHalfASpacingUnderEverySurface) {
  const Scene scene = cup_scene(0.06);
  const double dx = scene.particle_spacing;
  for (const int layers : {1, 2, 3}) {
    Scene layered = scene;
    layered.wall_layers = layers;
    const Walls walls = sample_walls(layered);
    for (const auto& x : walls.containers[0].position.colwise()) {
      const double layer = depth_in_cup(x) / dx - 0.5;
      EXPECT_NEAR(layer, std::round(layer), 1e-4) << x.transpose();
      EXPECT_GT(layer, -0.5) << x.transpose();
      EXPECT_LT(layer, layers - 0.5) << x.transpose();
    }
  }
}

TEST(CupWalls, AreAsManyAsTheirLayersHaveRoomFor) {
  const Scene scene = cup_scene(0.06);
  double area = 0;  // of the outline inset by each layer's depth, turned about the axis
  for (const double d : {0.5 * scene.particle_spacing, 1.5 * scene.particle_spacing}) {
    const double inner = cup_radius + d, outer = cup_radius + cup_thickness - d;
    area += pi * outer * outer + 2 * pi * outer * (cup_height + cup_thickness - 2 * d);  // bottom, side
    area += pi * (outer * outer - inner * inner);                                        // rim
    area += 2 * pi * inner * cup_height + pi * inner * inner;                            // cavity
  }
  const double expected = area / std::pow(scene.particle_spacing, 2);
  const auto count = static_cast<double>(sample_walls(scene).size());
  EXPECT_NEAR(count / expected, 1, 0.02);
}

TEST(CupWalls, LeaveNoHoleUnderTheCavitysSurface) {
  const Scene scene = cup_scene(0.06);
  const Eigen::Matrix3Xd wall = sample_walls(scene).containers[0].position;
  const Eigen::Matrix3Xd on = cloud(1, 2000, 0, 1);
  for (const auto& u : on.colwise()) {
    const double angle = 2 * pi * u.x();
    const bool bottom = u.y() < 0.3;
    const double r = bottom ? cup_radius * std::sqrt(u.z()) : cup_radius, z = bottom ? 0 : cup_height * u.z();
    const Vec3 x(r * std::cos(angle), r * std::sin(angle), z);
    // The farthest point of a cubic lattice's face: half a spacing along each axis.
    const double nearest = (wall.colwise() - x).colwise().norm().minCoeff();
    EXPECT_LT(nearest, 1.1 * std::sqrt(0.75) * scene.particle_spacing) << x.transpose();
  }
}

TEST(Walls, KeepASpacingFromTheFluidAndStayOutOfTheCavity) {
  for (const Scene& scene : {cup_scene(0.06), tank_scene()}) {
    const Container& container = scene.containers[0];
    const Eigen::Matrix3Xd wall = sample_walls(scene).containers[0].position;
    const Eigen::Matrix3Xd fluid = initial_state(scene).position.colwise() - container.origin;
    double nearest = 1;
    for (const auto& x : wall.colwise()) {
      EXPECT_FALSE(in_cavity(container, x));
      EXPECT_LT(signed_distance(container, x).distance, 0);
      nearest = std::min(nearest, (fluid.colwise() - x).colwise().norm().minCoeff());
    }
    EXPECT_GE(nearest, scene.particle_spacing * (1 - 1e-5)) << container.name;
    EXPECT_LE(nearest, scene.particle_spacing * 1.1) << container.name;
  }
}

/// A ring with an edge all around its hole, thinner than the layers asked for: insets of one face come out of
/// the other.
TEST(Walls, StayInsideASolidThatIsThinnerThanTheirLayers) {
  Scene scene = cup_scene(0.06);
  scene.wall_layers = 3;
  for (const double thickness_in_dx : {1.2, 2.0, 2.6, 3.4, 5.0})
    for (const double edge : {0.3, 0.6, 1.5}) {
      const double dx = scene.particle_spacing, high = thickness_in_dx * dx;
      Container& ring = scene.containers[0];
      ring.shape =
          RevolvedShape{{{1.2 * dx, 0}, {6 * dx, 0}, {6 * dx, high}, {1.5 * dx, high}, {edge * dx, 0.5 * high}}};
      const Eigen::Matrix3Xd wall = sample_walls(scene).containers[0].position;
      EXPECT_GT(wall.cols(), 0);
      for (const auto& x : wall.colwise())
        EXPECT_LT(signed_distance(ring, x).distance, -0.49 * dx)
            << thickness_in_dx << ' ' << edge << ": " << x.transpose();
    }
}

TEST(Walls, AreTheSameNumbersInSinglePrecision) {
  const Eigen::Matrix3Xd x = sample_walls(cup_scene(0.06)).containers[0].position;
  EXPECT_EQ(x, x.cast<float>().cast<double>());
}

TEST(TankWalls, AreTheLatticeCellsOfTheSolidThatAreFewLayersDeep) {
  Scene scene = tank_scene();
  const double dx = scene.particle_spacing;
  using Cell = Eigen::Vector3i;
  const auto solid = [](const Cell& c) {
    const bool box = (c.array() >= -6).all() && c.x() < 16 && c.y() < 12 && c.z() < 8;
    const bool cavity = (c.array() >= 0).all() && c.x() < 10 && c.y() < 6;
    return box && !cavity;
  };
  for (const int layers : {1, 2, 3}) {
    scene.wall_layers = layers;
    const auto near_the_surface = [&](const Cell& c) {
      for (int i = -layers; i <= layers; ++i)
        for (int j = -layers; j <= layers; ++j)
          for (int k = -layers; k <= layers; ++k)
            if (!solid(c + Cell(i, j, k))) return true;
      return false;
    };
    std::vector<std::array<double, 3>> expected, found;
    for (int i = -6; i < 16; ++i)
      for (int j = -6; j < 12; ++j)
        for (int k = -6; k < 8; ++k)
          if (solid({i, j, k}) && near_the_surface({i, j, k}))
            expected.push_back({(i + 0.5) * dx, (j + 0.5) * dx, (k + 0.5) * dx});
    const Walls walls = sample_walls(scene);
    for (const auto& x : walls.containers[0].position.colwise()) found.push_back({x.x(), x.y(), x.z()});
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected) << layers << " layers";
  }
}

TEST(RenderSurface, LiesOnTheSolidAndHasItsArea) {
  const double outer = cup_radius + cup_thickness;
  const double cup_area =
      2 * pi * outer * outer + 2 * pi * outer * (cup_height + cup_thickness) + 2 * pi * cup_radius * cup_height;
  const double dx = 1.0 / 64;  // outside and top of the tank's 22 × 18 × 14 block, and its cavity
  const double tank_area = dx * dx * (2 * (22 * 14 + 18 * 14 + 22 * 18) + 2 * (10 * 8 + 6 * 8));
  const std::pair<Container, double> cases[] = {{cup_scene(0.06).containers[0], cup_area},
                                                {tank_scene().containers[0], tank_area}};
  for (const auto& [container, expected] : cases) {
    const RenderSurface surface = render_surface(container, 0.002);
    for (const auto& x : surface.vertex.colwise()) EXPECT_NEAR(signed_distance(container, x).distance, 0, 1e-15);
    double area = 0;
    for (const auto& [a, b, c] : surface.triangle) {
      const Vec3 x = surface.vertex.col(a), y = surface.vertex.col(b), z = surface.vertex.col(c);
      area += 0.5 * (y - x).cross(z - x).norm();
    }
    EXPECT_NEAR(area / expected, 1, 1e-3) << container.name;
  }
}

class BoundaryVolume : public testing::TestWithParam<KernelFamily> {};
INSTANTIATE_TEST_SUITE_P(All, BoundaryVolume, testing::ValuesIn(families), family_name);

TEST_P(BoundaryVolume, IsTheLatticesInAnEndlessSlab) {
  for (const int layers : {1, 2, 6}) {
    const Scene scene = slab_scene(layers, GetParam());
    const double dx = scene.particle_spacing;
    const PlainKernel kernel{GetParam(), scene.support_radius()};
    const Walls walls = sample_walls(scene);
    const Eigen::VectorXd volumes = boundary_volumes<double>(scene, walls);
    ASSERT_EQ(walls.size(), 64 * layers);
    for (Eigen::Index b = 0; b < walls.size(); ++b) {
      const int layer = static_cast<int>(std::floor(-walls.containers[0].position(2, b) / dx));
      double sum = 0;
      for (int i = -2; i <= 2; ++i)
        for (int j = -2; j <= 2; ++j)
          for (int k = 0; k < layers; ++k) sum += kernel.W(dx * std::hypot(i, j, k - layer));
      EXPECT_NEAR(volumes[b] * sum, 1, 1e-13) << "layer " << layer << " of " << layers;
    }
  }
}

TEST_P(BoundaryVolume, BelongsToTheContainerAloneWhereverItStands) {
  const Scene alone = slab_scene(2, GetParam());
  Scene beside = alone;
  beside.containers.push_back(alone.containers[0]);
  beside.containers[0].origin = alone.particle_spacing * Vec3(3, -2, -2);
  const Eigen::VectorXd one = boundary_volumes<double>(alone, sample_walls(alone));
  const Eigen::VectorXd two = boundary_volumes<double>(beside, sample_walls(beside));
  ASSERT_EQ(two.size(), 2 * one.size());
  EXPECT_LT((two.head(one.size()) - one).norm(), 1e-14 * one.norm());
  EXPECT_LT((two.tail(one.size()) - one).norm(), 1e-14 * one.norm());
}

TEST(CupFill, HasTheVolumeUpToTheLevel) {
  for (const double level : {0.03, 0.06, 0.0874}) {
    const Scene scene = cup_scene(level);
    const double dx = scene.particle_spacing;
    const double layers = std::floor(level / dx + 1e-6);
    const double volume =
        static_cast<double>(initial_state(scene).size()) * scene.particle_mass() / scene.fluid.rest_density;
    // A layer holds the cells whose centre is dx/2 from the wall; a cell reaches dx/√2 about it.
    const double least = cup_radius - 0.5 * dx - dx / std::sqrt(2), most = least + dx * std::sqrt(2);
    EXPECT_GT(volume, layers * dx * pi * least * least) << level;
    EXPECT_LT(volume, layers * dx * pi * most * most) << level;
  }
}

TEST(CupFill, IsALatticeInTheCavityHalfASpacingFromItsSurface) {
  const Scene scene = cup_scene(0.06);
  const double dx = scene.particle_spacing;
  const ParticleState state = initial_state(scene);
  for (Eigen::Index i = 0; i < state.size(); ++i) {
    const Vec3 x = state.position.col(i) - scene.containers[0].origin;
    EXPECT_LE(std::hypot(x.x(), x.y()), cup_radius - dx / 2 + 1e-7);
    const Vec3 cell = x / dx - Vec3::Constant(0.5);
    EXPECT_LT((cell.array() - cell.array().round()).abs().maxCoeff(), 1e-4);
  }
  const auto z = state.position.row(2).array() - scene.containers[0].origin.z();
  EXPECT_NEAR(z.minCoeff(), 0.5 * dx, 1e-8);
  EXPECT_NEAR(z.maxCoeff(), 0.06 - 0.5 * dx, 1e-8);
  EXPECT_EQ(state.velocity, Vec3(1, 2, 3).replicate(1, state.size()));
}

TEST(TankFill, RunsAlongXFirstAndStopsBelowTheLevel) {
  const Scene scene = tank_scene();
  const double dx = scene.particle_spacing;
  const ParticleState state = initial_state(scene);
  ASSERT_EQ(state.size(), 10 * 6 * 5);
  Eigen::Index n = 0;
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 10; ++i)
        EXPECT_EQ(Vec3(state.position.col(n++)), scene.containers[0].origin + dx * Vec3(i + 0.5, j + 0.5, k + 0.5));
}

TEST(BoxFill, StandsInTheWorldOrInItsContainersFrame) {
  Scene scene = tank_scene();
  const double dx = scene.particle_spacing;
  const SolidBox box{dx * Vec3(1, 1, 1), dx * Vec3(3, 2, 2.9)};
  scene.fills = {{"", 0, box, Vec3::Zero()}, {"tank", 0, box, Vec3::UnitX()}};
  const ParticleState state = initial_state(scene);
  ASSERT_EQ(state.size(), 4);  // 2 × 1 × 1 each: 1.9 spacings hold one layer
  EXPECT_EQ(Vec3(state.position.col(1)), dx * Vec3(2.5, 1.5, 1.5));
  EXPECT_EQ(Vec3(state.position.col(3)), scene.containers[0].origin + dx * Vec3(2.5, 1.5, 1.5));
  EXPECT_EQ(Vec3(state.velocity.col(3)), Vec3::UnitX());
}

TEST(RoundFill, LiesEvenlyAboutItsCenter) {
  Scene scene = tank_scene();
  const double dx = scene.particle_spacing;
  scene.containers.clear();
  scene.domain = {Vec3(-1, -1, -1), Vec3(1, 1, 1), {}};
  const Vec3 center(0.25, -0.125, 0.5);
  Fill ball;
  ball.round = RoundShape{center, 3.2 * dx};
  ball.box = ball.round->bounds();
  scene.fills = {ball};
  const ParticleState state = initial_state(scene);
  EXPECT_LT((state.position.rowwise().mean() - center).norm(), 1e-7);
  Eigen::Index expected = 0;
  for (int k = -4; k < 4; ++k)
    for (int j = -4; j < 4; ++j)
      for (int i = -4; i < 4; ++i) expected += Vec3(i + 0.5, j + 0.5, k + 0.5).norm() <= 2.7;
  EXPECT_EQ(state.size(), expected);
}

TEST(RoundFill, ARodAsLongAsThePeriodGoesOnAcrossIt) {
  Scene scene = tank_scene();
  const double dx = scene.particle_spacing;
  scene.containers.clear();
  scene.domain = {Vec3(-1, 0, -1), Vec3(1, 6 * dx, 1), {false, true, false}};
  Fill rod;
  rod.round = RoundShape{Vec3(0, 3 * dx, 0), 4 * dx, 1, 6 * dx};
  rod.box = rod.round->bounds();
  scene.fills = {rod};
  const ParticleState state = initial_state(scene);
  EXPECT_EQ(state.size() % 6, 0);
  EXPECT_NEAR(state.position.row(1).minCoeff(), 0.5 * dx, 1e-8);
  EXPECT_NEAR(state.position.row(1).maxCoeff(), 5.5 * dx, 1e-8);
  EXPECT_LE((state.position.row(0).array().square() + state.position.row(2).array().square()).sqrt().maxCoeff(),
            3.5 * dx * (1 + 1e-6));
}

TEST(Fill, VelocityFollowsItsGradientInTheWorld) {
  Scene scene = tank_scene();
  Fill& fill = scene.fills[0];
  fill.velocity = {1, 2, 3};
  fill.velocity_gradient << 0, 1, 0, 0, 0, -2, 3, 0, 0;
  fill.gradient_about = {0.1, 0.2, 0.3};
  const ParticleState state = initial_state(scene);
  for (Eigen::Index i = 0; i < state.size(); ++i) {
    const Vec3 d = state.position.col(i) - fill.gradient_about;
    EXPECT_LT((state.velocity.col(i) - Vec3(1 + d.y(), 2 - 2 * d.z(), 3 + 3 * d.x())).norm(), 1e-6);
  }
}

TEST(CupFill, LeansWithACupThatStartsTilted) {
  Scene scene = cup_scene(0.06);
  const Vec3 pivot = scene.containers[0].origin;
  const auto upright = initial_state(scene).position;
  scene.containers[0].tilt = Tilt{pivot, Vec3::UnitY(), {{0, 0.3}}};
  const Eigen::AngleAxisd turn(0.3, Vec3::UnitY());
  const Eigen::Matrix3Xd expected = (turn.toRotationMatrix() * (upright.colwise() - pivot)).colwise() + pivot;
  const auto leaning = initial_state(scene).position;
  ASSERT_EQ(leaning.cols(), expected.cols());
  EXPECT_LT((leaning - expected).colwise().norm().maxCoeff(), 1e-7);
}

TEST(CupFill, IsRefusedWhereItHoldsNoParticle) { EXPECT_THROW(initial_state(cup_scene(0.004)), std::runtime_error); }

}  // namespace
}  // namespace decant::test
