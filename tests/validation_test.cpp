/// \file
/// Validation's own arithmetic: exact solutions against their equations and published figures,
/// observers against states that are right by construction and against wrong ones.
#include "tools/validation/observers.hpp"
#include "tools/validation/wall_patch.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/solution/reference_backend.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_file.hpp"
#include "reference/solver.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

namespace decant {
namespace {

namespace fs = std::filesystem;

const fs::path fixtures = fs::path(DECANT_SOURCE_DIR) / "fixtures";

const validate::Case& case_named(std::string_view name) {
  for (const auto& which : validate::cases())
    if (which.name == name) return which;
  throw std::out_of_range(std::string(name));
}

/// A run that never runs: states are handed to the case's observer.
struct Staged {
  explicit Staged(const std::string& name, int resolution = 0)
      : which(case_named(name)),
        layers(resolution ? resolution : which.resolutions.front()),
        scene(validate::scene_of(which, layers, fixtures / "scenes")),
        walls(sample_walls(scene)),
        state(initial_state(scene)),
        fields(Fields::unwritten(state.size(), walls.size())),
        observer(which.observe({scene, walls, layers, false, fixtures / "experiments"})) {
    fields.fluid_neighbor_count.setConstant(30);
  }

  void sample(double time) {
    state.substep = std::llround(time / scene.time_step());
    observer->sample({time, state, fields});
  }

  validate::Result finish() {
    validate::Result result;
    observer->finish(result);
    return result;
  }

  const validate::Case& which;
  int layers;
  Scene scene;
  Walls walls;
  ParticleState state;
  Fields fields;
  std::unique_ptr<validate::Observer> observer;
};

const validate::Quantity& quantity(const validate::Result& result, std::string_view start) {
  for (const auto& q : result.quantities)
    if (q.name.starts_with(start)) return q;
  throw std::out_of_range(std::string(start));
}

TEST(ExactSolutions, CupResidualHasThePublishedVolumes) {
  const double expected[][2] = {{0, 346.36},  {15, 310.27}, {30, 268.59}, {45, 211.67},
                                {60, 123.13}, {75, 43.86},  {85, 8.66}};
  for (const auto& [degrees, volume] : expected)
    EXPECT_NEAR(1e6 * validate::cup_residual(0.035, 0.09, degrees * std::numbers::pi / 180), volume, 0.006) << degrees;
}

TEST(ExactSolutions, DropHasMonaghansAxes) {
  EXPECT_NEAR(validate::drop_axis(100, 0.0008), 1.083103, 1e-6);
  EXPECT_NEAR(validate::drop_axis(100, 0.0038), 1.439219, 1e-6);
  EXPECT_NEAR(validate::drop_axis(100, 0.0076), 1.944517, 1e-6);
}

// u_t = nu u_zz + F, u = 0 at the start and at plates at rest.
TEST(ExactSolutions, ChannelSeriesSolveTheirEquation) {
  constexpr double V = 0.05, F = 0.2, nu = 2e-4, L = 0.02, d = 1e-5, e = 1e-4;
  for (const double z : {0.003, 0.01, 0.018})
    for (const double t : {0.1, 0.4}) {
      const auto residual = [&](auto u, double force) {
        const double rate = (u(z, t + e) - u(z, t - e)) / (2 * e);
        const double curvature = (u(z + d, t) - 2 * u(z, t) + u(z - d, t)) / (d * d);
        return std::abs(rate - nu * curvature - force);
      };
      EXPECT_LT(residual([&](double y, double s) { return validate::couette_velocity(V, nu, L, y, s); }, 0), 1e-4);
      EXPECT_LT(residual([&](double y, double s) { return validate::poiseuille_velocity(F, nu, L, y, s); }, F), 1e-4);
    }
  EXPECT_NEAR(validate::couette_velocity(V, nu, L, L, 0.2), V, 1e-12);
  EXPECT_NEAR(validate::couette_velocity(V, nu, L, 0, 0.2), 0, 1e-12);
  EXPECT_NEAR(validate::couette_velocity(V, nu, L, 0.01, 0.01), 0, 1e-4 * V);
  EXPECT_NEAR(validate::poiseuille_velocity(F, nu, L, 0.01, 0), 0, 1e-5 * V);
  EXPECT_NEAR(validate::poiseuille_velocity(F, nu, L, 0.01, 100), F * L * L / (8 * nu), 1e-12);
}

TEST(Curves, AnswerBetweenTheirPoints) {
  const validate::Curve curve{{0, 1, 3}, {0, 2, -2}};
  EXPECT_DOUBLE_EQ(validate::value_at(curve, 0.5), 1);
  EXPECT_DOUBLE_EQ(validate::value_at(curve, 3), -2);
  EXPECT_TRUE(std::isnan(validate::value_at(curve, 3.1)));
  EXPECT_DOUBLE_EQ(validate::first_reach(curve, 1), 0.5);
  EXPECT_TRUE(std::isnan(validate::first_reach(curve, 2.1)));
  EXPECT_EQ(validate::first_reach_between(curve, 1), std::pair(0.0, 1.0));
  EXPECT_DOUBLE_EQ(validate::integral(curve, 0.5, 2), 0.75 + 1);
  EXPECT_TRUE(std::isnan(validate::integral(curve, -1, 2)));
  EXPECT_DOUBLE_EQ(validate::slope(curve, 0, 1), 2);
  EXPECT_TRUE(std::isnan(validate::slope(curve, 2, 4)));
}

TEST(Curves, RefuseWhatIsNoNumberNamingTheLine) {
  const auto file = fs::temp_directory_path() / "decant-curve.csv";
  std::ofstream(file) << "# cited\nx,y\n1,2\n2,three\n";
  try {
    (void)validate::read_curve(file);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.key(), "line 4");
    EXPECT_EQ(error.value(), "2,three");
  }
  fs::remove(file);
}

TEST(Curves, EveryMeasuredFileIsReadAndCitesItsSource) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(fixtures / "experiments")) {
    EXPECT_GE(validate::read_curve(entry.path()).x.size(), 8u) << entry.path();
    std::string first;
    std::getline(std::ifstream(entry.path()), first);
    EXPECT_TRUE(first.starts_with("# ")) << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 12);
}

TEST(Validation, EverySceneHoldsAtEveryResolution) {
  for (const auto& which : validate::cases())
    for (const int resolution : which.resolutions) {
      const Scene scene = validate::scene_of(which, resolution, fixtures / "scenes");
      EXPECT_DOUBLE_EQ(scene.particle_spacing, which.length / resolution) << which.name;
      EXPECT_LE(which.quick, which.affordable) << which.name;
    }
}

class StillWaterPressure : public testing::TestWithParam<double> {};

TEST_P(StillWaterPressure, IsJudgedByItsProfile) {
  Staged run("still-tank", 20);
  run.fields.pressure = 1000 * 9.81 * (0.1 - run.state.position.row(2).transpose().array());
  run.fields.pressure *= GetParam();
  run.sample(0);
  run.sample(0.9);
  const auto result = run.finish();
  EXPECT_EQ(result.passed(), GetParam() == 1.0);
  EXPECT_NEAR(quantity(result, "level").error, 0, 1e-6);
  EXPECT_NEAR(quantity(result, "pressure of the first").error, std::abs(GetParam() - 1), 1e-6);
}
INSTANTIATE_TEST_SUITE_P(By, StillWaterPressure, testing::Values(1.0, 1.05, 0.9));

TEST(Validation, StillWaterWithANaNFails) {
  Staged run("still-tank", 20);
  run.fields.pressure = 1000 * 9.81 * (0.1 - run.state.position.row(2).transpose().array());
  const Vec3 middle(0.0275, 0.0275, 0.0525);
  Eigen::Index inside = 0;
  (run.state.position.colwise() - middle).colwise().norm().minCoeff(&inside);
  run.fields.pressure[inside] = NAN;
  run.sample(0.9);
  EXPECT_FALSE(run.finish().passed());
}

TEST(Validation, ChannelFlowIsJudgedByItsProfile) {
  for (const char* name : {"couette", "poiseuille"})
    for (const double factor : {1.0, 1.05}) {
      Staged run(name, 20);
      for (const double t : {0.0, 0.1, 0.3, 0.9}) {
        for (Eigen::Index i = 0; i < run.state.size(); ++i) {
          const double z = run.state.position(2, i);
          run.state.velocity(0, i) = factor * (name[0] == 'c' ? validate::couette_velocity(0.05, 2e-4, 0.02, z, t)
                                                              : validate::poiseuille_velocity(0.2, 2e-4, 0.02, z, t));
        }
        run.sample(t);
      }
      const auto result = run.finish();
      EXPECT_EQ(result.passed(), factor == 1.0) << name;
      EXPECT_TRUE(factor != 1.0 || result.quantities.at(0).error < 1e-9) << name;
    }
}

TEST(Validation, DropIsJudgedByItsAxes) {
  for (const double factor : {1.0, 1.05}) {
    Staged run("drop");
    const Eigen::Matrix3Xd start = run.state.position;
    for (int k = 0; k <= 38; ++k) {
      const double t = 0.0002 * k, b = k ? factor * validate::drop_axis(100, t) : 1;
      run.state.position.row(0) = start.row(0) / b;
      run.state.position.row(2) = start.row(2) * b;
      run.sample(t);
    }
    const auto result = run.finish();
    EXPECT_EQ(result.passed(), factor == 1.0);
    EXPECT_NEAR(quantity(result, "a·b").result, 1, 1e-6);
  }
}

TEST(Validation, DamFrontIsJudgedAgainstTheTable) {
  const validate::Curve table = validate::read_curve(fixtures / "experiments/martin_moyce_table2_front.csv");
  for (const double factor : {1.0, 1.15}) {
    Staged run("dam-front", 20);
    for (int k = 0; k <= 120; ++k) {
      const double t = 0.002 * k, T = t * std::sqrt(2 * 9.81 / 0.05715);
      double Z = validate::value_at(table, T);
      if (std::isnan(Z)) Z = T < 1 ? 1.11 : 4.11;
      // A spray particle ahead of the front counts for nothing.
      run.state.position(0, 0) = 0.05715 * factor * Z - 0.5 * run.scene.particle_spacing;
      run.state.position(0, 1) = 0.4;
      run.fields.fluid_neighbor_count[1] = 2;
      run.sample(t);
    }
    const auto result = run.finish();
    EXPECT_EQ(result.passed(), factor == 1.0);
    EXPECT_TRUE(factor != 1.0 || quantity(result, "front speed").error < 0.03);
  }
}

// What the walls do to the fluid, a patch of all of them gets back.
TEST(Validation, WallPatchFeelsTheReactionToWallPressure) {
  const Scene scene = validate::scene_of(case_named("still-tank"), 10, fixtures / "scenes");
  const Walls walls = sample_walls(scene);
  ParticleState state = initial_state(scene);
  state.position.row(2).array() -= 0.2 * scene.particle_spacing;
  Solver solver(scene, walls, state);
  Fields fields;
  solver.fields(fields);
  const SolidBox below{{-1, -1, -1}, {1, 1, 0}};
  // The floor reaches under the side walls: every wall particle below z = 0 is in the patch.
  const validate::WallPatch patch(scene, walls, below, {0, 0, -1});
  double force = 0;
  const PosedWalls posed = pose_walls(scene, walls, 0);
  const PosedWalls only = [&] {
    PosedWalls part = posed;
    for (Eigen::Index b = 0; b < part.position.cols(); ++b)
      if (part.position(2, b) > 0) part.position.col(b).setConstant(100);
    return part;
  }();
  Neighbors near;
  find_neighbors(scene, state.position, only.position, NeighborSearch::all_pairs, near);
  Fields part;
  // The same density and pressure, only the walls below.
  const StageInputs given{fields.boundary_volume, fields.density, fields.pressure};
  evaluate<double>(scene, state, only, fields.boundary_volume, near, part, &given);
  force = scene.particle_mass() * part.wall_pressure_acceleration.row(2).sum();
  ASSERT_GT(force, 0);
  EXPECT_NEAR(patch.pressure(state, fields) * patch.area() / force, 1, 1e-9);
}

TEST(Validation, WallPatchRefusesASpotWithoutWall) {
  const Scene scene = validate::scene_of(case_named("still-tank"), 10, fixtures / "scenes");
  EXPECT_THROW(validate::WallPatch(scene, sample_walls(scene), {{0.02, 0.02, 0.02}, {0.03, 0.03, 0.03}}, {1, 0, 0}),
               std::runtime_error);
}

TEST(Validation, SlitIsJudgedByItsDischarge) {
  for (const double coefficient : {0.61, 0.75}) {
    Staged run("slit", 16);
    const Eigen::Matrix3Xd start = run.state.position;
    for (int k = 0; k <= 140; ++k) {
      const double t = 0.01 * k;
      const double root = std::sqrt(0.2) - coefficient * 0.1 * std::sqrt(9.81 / 2) * t;
      const auto left =
          static_cast<Eigen::Index>(std::lround(root * root / 0.2 * static_cast<double>(run.state.size())));
      run.state.position = start;
      run.state.position.rightCols(run.state.size() - left).row(2).setConstant(0.1);
      run.sample(t);
    }
    EXPECT_EQ(run.finish().passed(), coefficient == 0.61);
  }
}

TEST(Validation, SlowPourIsJudgedByItsResidual) {
  for (const double factor : {1.0, 1.2}) {
    Staged run("slow-pour", 20);
    const double each = run.scene.particle_mass() / run.scene.fluid.rest_density;
    const Eigen::Matrix3Xd start = run.state.position;
    const double holds[][3] = {{1.2, 5.2, 15}, {6.2, 14.2, 30}, {15.2, 25.2, 45}, {26.2, 40.2, 60}};
    run.sample(0);
    for (const auto& [from, to, degrees] : holds) {
      const double volume = factor * validate::cup_residual(0.035, 0.09, degrees * std::numbers::pi / 180);
      const auto inside = std::min<Eigen::Index>(run.state.size(), std::lround(volume / each));
      // Those inside turn with the cup, the others lie in the tray.
      const Pose pose = pose_at(run.scene.containers[0], to), first = pose_at(run.scene.containers[0], 0);
      for (Eigen::Index i = 0; i < run.state.size(); ++i)
        run.state.position.col(i) = i < inside ? pose.to_world(first.to_local(start.col(i)))
                                               : Vec3(-0.1 + 1e-6 * static_cast<double>(i), 0, 0.01);
      for (const double t : {from, to - 0.4, to - 0.2, to, to + 0.01}) run.sample(t);
    }
    const auto result = run.finish();
    for (const char* at : {"residual at 30", "residual at 45", "residual at 60"}) {
      const auto& q = quantity(result, at);
      EXPECT_TRUE(q.gated());
      EXPECT_EQ(q.met(), factor == 1.0) << at << " " << q.error;
    }
  }
}

TEST(Validation, OrdersComeFromNeighboringResolutions) {
  std::vector<validate::Result> results(3);
  for (int k = 0; k < 3; ++k) {
    results[static_cast<std::size_t>(k)].name = "case";
    results[static_cast<std::size_t>(k)].resolution = 10 << k;
    results[static_cast<std::size_t>(k)].add({"error", "1", 0, 0, 0.16 / (1 << (2 * k))});
  }
  const auto orders = validate::observed_orders(results);
  ASSERT_EQ(orders.size(), 2u);
  EXPECT_NEAR(orders[0].order, 2, 1e-12);
  EXPECT_EQ(orders[1].fine, 40);
}

TEST(Validation, ReportHoldsFiguresAndCurves) {
  validate::Result result;
  result.name = "case";
  result.resolution = 20;
  result.add({"right", "1", 1, 1.01, 0.01, 0.02});
  result.add({"wrong", "m", 1, 1.05, 0.05, 0.02});
  result.add({"told", "m", 1, 1.05, 0.05});
  result.curves.push_back({"panel", "found", "x", "m", "y", "Pa", false, {0, 1}, {2, 3}});
  EXPECT_FALSE(result.passed());
  const auto file = fs::temp_directory_path() / "decant-validation.h5";
  validate::write(file, {result});
  const Hdf5Reader in(file);
  EXPECT_EQ(in.strings("/quantities/verdict"), (std::vector<std::string>{"pass", "fail", "reported"}));
  EXPECT_EQ(in.vector("/curves/0000/y"), Eigen::Vector2d(2, 3));
  EXPECT_EQ(in.text_attribute("/curves/0000/y", "unit"), "Pa");
  const std::string table = validate::table({result});
  EXPECT_NE(table.find("5.00 %    2.00 %  fail"), std::string::npos) << table;
  fs::remove(file);
}

TEST(Validation, FreeFallOfTheOracleItselfKeepsItsCentre) {
  const auto& which = case_named("free-fall");
  const Scene scene = validate::scene_of(which, 5, fixtures / "scenes");
  const auto backend = make_reference_backend();
  const auto result = validate::run(which, 5, scene, *backend, fixtures / "experiments");
  EXPECT_TRUE(result.passed()) << validate::table({result});
  EXPECT_GT(result.substeps, 100);
}

}  // namespace
}  // namespace decant
