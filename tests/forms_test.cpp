/// \file
/// A few of the legal forms of tests/studies/forms.cpp, on every build: none exceeds a tolerance, and the
/// evaluator they are written in is not so loose that a fault would pass.
#include "tests/forms.hpp"
#include "oracle/files/fixture_file.hpp"

#include "reference/sampling.hpp"
#include "reference/shapes.hpp"

#include <gtest/gtest.h>

namespace decant {
namespace {

using test::Forms;

struct Problem {
  Fixture fixture;
  Walls walls;
  WallSolution volumes;
  ReferenceSolution own, given;
  StageInputs staged;

  explicit Problem(Fixture f)
      : fixture(std::move(f)),
        walls(sample_walls(fixture.scene)),
        volumes(wall_solution(fixture.scene, walls)),
        own(reference_solution(fixture.scene, walls, volumes, fixture.state)) {
    staged.density = own.fields.density.cast<float>().cast<double>();
    staged.pressure = own.fields.pressure.cast<float>().cast<double>();
    given = reference_solution(fixture.scene, walls, volumes, fixture.state, &staged);
  }
  void expect_within(const Forms& forms) const {
    std::string text = fixture.name;
    for (const auto& [name, value] : test::choices(forms)) text += ", " + name + ": " + value;
    const auto expect = [&](const ReferenceSolution& oracle, const StageInputs* inputs) {
      const Fields got = test::evaluate_by(forms, fixture.scene, walls, fixture.state, inputs);
      for (const auto& [field, score] : test::scores(got, oracle))
        EXPECT_LE(score, 1) << field << (inputs ? ", staged; " : "; ") << text;
    };
    expect(own, nullptr);
    expect(given, &staged);
  }
};

TEST(LegalForms, StayWithinEveryTolerance) {
  for (std::uint32_t seed = 1; seed <= 24; ++seed) {
    const Problem problem(test::random_form_case(seed));
    std::mt19937 random(seed);
    for (int k = 0; k < 3; ++k) problem.expect_within(test::random_forms(random));
  }
}

TEST(LegalForms, StayWithinEveryToleranceOnAPourAtRest) {
  const Problem problem(read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-rest.h5"));
  Forms forms;
  forms.accumulate = Forms::Register::gravity_first;
  problem.expect_within(forms);
  forms.order = Forms::Order::smallest_first;
  forms.constants = Forms::Constant::formed;
  problem.expect_within(forms);
}

/// A block on an exact lattice, many neighbors and a slow shear: hundreds of equal terms, far smaller than g.
TEST(LegalForms, MayStartASumFromGravityWhereTermsAreManyAndEqual) {
  for (const double ratio : {3.0, 5.0}) {
    Fixture f = test::random_form_case(1);
    f.scene.containers.clear();
    f.scene.support_ratio = ratio;
    f.scene.gravity = Vec3(0, 0, -9.81);
    f.scene.fluid.viscosity = 0.05;
    f.scene.domain = {Vec3::Constant(-1), Vec3::Constant(1), {}};
    const double dx = f.scene.particle_spacing = 0.004;
    f.state.position.resize(3, 343);
    f.state.velocity.setZero(3, 343);
    for (Eigen::Index i = 0; i < 343; ++i) {
      f.state.position.col(i) =
          dx * Vec3(static_cast<double>(i % 7), static_cast<double>(i / 7 % 7), static_cast<double>(i / 49));
      f.state.velocity(2, i) = 1e-4 * static_cast<double>(i % 7);
    }
    f.state.quantise();
    f.state.substep = 0;
    const Problem problem(std::move(f));
    Forms forms;
    forms.accumulate = Forms::Register::gravity_first;
    for (const auto order : {Forms::Order::by_id, Forms::Order::largest_first, Forms::Order::random}) {
      forms.order = order;
      problem.expect_within(forms);
    }
  }
}

/// Drag too small for fp32, in every digit or in none: what rests but for a last place of a rotated normal.
TEST(LegalForms, MayTakeForZeroWhatUnderflows) {
  Fixture f = test::random_form_case(1);
  Scene& scene = f.scene;
  const double dx = scene.particle_spacing = 0.004;
  scene.fluid.viscosity = 0.05;
  scene.fluid.wall_viscosity = 0.1;
  scene.containers = {{"tank", tank_shape(Vec3::Constant(5 * dx), 3 * dx, {}), Vec3::Zero(), 3 * dx, {}}};
  scene.domain = {Vec3::Constant(-1), Vec3::Constant(1), {}};
  f.state.position.resize(3, 27);
  for (Eigen::Index i = 0; i < 27; ++i)
    f.state.position.col(i) =
        dx * (Vec3(static_cast<double>(i % 3), static_cast<double>(i / 3 % 3), static_cast<double>(i / 9)) +
              Vec3::Constant(0.5));
  f.state.substep = 0;
  bool lost = false;
  for (int exponent = -149; exponent <= -100; ++exponent) {
    f.state.velocity = Eigen::Matrix3Xd::Constant(3, 27, std::exp2(exponent));
    f.state.quantise();
    const Problem problem(f);
    Forms forms;
    for (const bool flushed : {false, true})
      for (const auto factor : {Forms::Factor::in_terms, Forms::Factor::after_sum}) {
        forms.flushed = flushed;
        forms.factor = factor;
        problem.expect_within(forms);
      }
    const Fields got = test::evaluate_by(forms, scene, problem.walls, f.state, nullptr);
    lost = lost || (got.wall_viscous_acceleration.isZero(0) && !problem.own.fields.wall_viscous_acceleration.isZero(0));
  }
  EXPECT_TRUE(lost) << "no form takes anything for 0";
}

TEST(LegalForms, AreNotAllowedUnderflowWhereThereIsNone) {
  const Problem problem(read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-filling.h5"));
  Fields got = problem.given.fields;
  got.wall_viscous_acceleration.setZero();
  EXPECT_GT(test::scores(got, problem.given).at("wall_viscous_acceleration"), 1e3);
}

TEST(LegalForms, AreNotWhatFaultsHideBehind) {
  const Problem problem(read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-filling.h5"));
  const auto score = [&](const char* field, void (*wrong)(Fields&)) {
    Fields got = test::evaluate_by({}, problem.fixture.scene, problem.walls, problem.fixture.state, &problem.staged);
    wrong(got);
    return test::scores(got, problem.given).at(field);
  };
  EXPECT_GT(score("density", [](Fields& f) { f.density *= 1 + 2e-6; }), 1);
  EXPECT_GT(score("pressure", [](Fields& f) { f.pressure *= 1 + 1e-5; }), 1);
  EXPECT_GT(score("viscous_acceleration", [](Fields& f) { f.viscous_acceleration *= 1 + 1e-5; }), 1);
  EXPECT_GT(score("wall_viscous_acceleration", [](Fields& f) { f.wall_viscous_acceleration *= 1 + 3e-5; }), 1);
}

}  // namespace
}  // namespace decant
