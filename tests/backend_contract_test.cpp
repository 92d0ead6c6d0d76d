/// \file
/// What every backend promises beyond right numbers: states come back as they went in, work can be
/// split anywhere, trouble is reported and named, and scenes with next to nothing in them run.
#include "tests/backend_variants.hpp"
#include "tests/random_scene.hpp"

#include "gpu/backends.hpp"
#include "oracle/solution/reference_backend.hpp"
#include "reference/error.hpp"
#include "tests/special_values.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace decant {
namespace {

using test::nan;

std::vector<test::Variant> choices() {
  std::vector<test::Variant> all = test::backend_variants();
  all.push_back({"reference", Executor::host});
  return all;
}

class BackendContract : public testing::TestWithParam<test::Variant> {
 protected:
  void SetUp() override {
    std::string why_not;
    if (!executor_available(GetParam().executor, &why_not)) GTEST_SKIP() << why_not;
    backend_ = GetParam().name == "reference" ? make_reference_backend() : test::make_variant(GetParam());
  }

  void load(const Fixture& f) { backend_->load(f.scene, sample_walls(f.scene), f.state); }
  ParticleState state() const {
    ParticleState s;
    backend_->read(s);
    return s;
  }
  static void expect_equal(const ParticleState& a, const ParticleState& b) {
    EXPECT_EQ(a.substep, b.substep);
    EXPECT_TRUE(a.position == b.position);
    EXPECT_TRUE(a.velocity == b.velocity);
  }
  /// A few particles in the open, in the middle of the domain.
  static Fixture drops(std::initializer_list<Vec3> positions) {
    Fixture f = test::random_fixture(3);
    f.scene.containers.clear();
    f.scene.domain = {Vec3(-1, -1, -1), Vec3(1, 1, 1), {}};
    f.state.position.resize(3, static_cast<Eigen::Index>(positions.size()));
    Eigen::Index i = 0;
    for (const Vec3& x : positions) f.state.position.col(i++) = x;
    f.state.velocity.setZero(3, i);
    f.state.quantise();
    return f;
  }

  std::unique_ptr<Backend> backend_;
};

TEST_P(BackendContract, AStateComesBackAsItWentIn) {
  Fixture f = test::random_fixture(1);
  f.state.substep = 1234;
  load(f);
  expect_equal(state(), f.state);
}

/// Density alone: pressure is that of the given density, and accelerations follow from both.
TEST_P(BackendContract, GivenDensityHasThePressureThatFollows) {
  const Fixture f = test::random_fixture(2);
  load(f);
  const Eigen::Index n = f.state.size(), m = sample_walls(f.scene).size();
  StageInputs given;
  given.density =
      f.scene.fluid.rest_density * (1.05 + 0.1 * Eigen::ArrayXd::LinSpaced(n, -1, 1)).cast<float>().cast<double>();
  given.density = given.density.cast<float>().cast<double>().eval();
  Fields alone = Fields::unwritten(n, m), own = alone, both = alone;
  ASSERT_TRUE(backend_->evaluate(own).ok());
  ASSERT_TRUE(backend_->evaluate(alone, &given).ok());
  const FluidProperties& fluid = f.scene.fluid;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double power = std::pow(given.density[i] / fluid.rest_density, fluid.eos_exponent),
                 p = f.scene.eos_stiffness() * (power - 1);
    EXPECT_NEAR(alone.pressure[i], fluid.allow_tension ? p : std::max(p, 0.0),
                2e-6 * f.scene.eos_stiffness() * (power + 1));
  }
  EXPECT_TRUE(alone.density == own.density) << "the density summed is told all the same";
  given.pressure = alone.pressure;
  ASSERT_TRUE(backend_->evaluate(both, &given).ok());
  EXPECT_TRUE(both.pressure == alone.pressure);
  EXPECT_TRUE(both.acceleration == alone.acceleration);
  EXPECT_FALSE(both.acceleration == own.acceleration);
}

TEST_P(BackendContract, EvaluatingLeavesTheStateAlone) {
  const Fixture f = test::random_fixture(2);
  load(f);
  Fields out = Fields::unwritten(f.state.size(), sample_walls(f.scene).size());
  ASSERT_TRUE(backend_->evaluate(out).ok());
  expect_equal(state(), f.state);
}

TEST_P(BackendContract, EvaluatingOnTheWayChangesNothing) {
  const Fixture f = test::random_fixture(4);
  const auto run = [&](bool samples) {
    load(f);
    Fields out = Fields::unwritten(f.state.size(), sample_walls(f.scene).size());
    for (const int segment : {3, 8, 5}) {
      EXPECT_TRUE(backend_->advance(segment).ok());
      for (int k = 0; samples && k < 2; ++k) EXPECT_TRUE(backend_->evaluate(out).ok());
    }
    return state();
  };
  expect_equal(run(true), run(false));
}

TEST_P(BackendContract, TwoStretchesAreOneLongOne) {
  const Fixture f = test::random_fixture(4);
  load(f);
  ASSERT_TRUE(backend_->advance(7).ok());
  const ParticleState whole = state();
  load(f);
  ASSERT_TRUE(backend_->advance(3).ok());
  ASSERT_TRUE(backend_->advance(4).ok());
  if (GetParam().name.starts_with("list")) {
    // Lists are made anew where a segment begins, which changes the order of sums.
    EXPECT_EQ(state().substep, whole.substep);
    EXPECT_LE((state().position - whole.position).cwiseAbs().maxCoeff(), 1e-5 * f.scene.particle_spacing);
  } else {
    expect_equal(state(), whole);
  }
  EXPECT_EQ(whole.substep, f.state.substep + 7);
  EXPECT_FALSE(whole.position == f.state.position);
}

TEST_P(BackendContract, TheSameAgainGivesTheSameBits) {
  const Fixture f = test::random_fixture(9);
  load(f);
  ASSERT_TRUE(backend_->advance(25).ok());
  const ParticleState once = state();
  load(f);
  ASSERT_TRUE(backend_->advance(25).ok());
  expect_equal(state(), once);
}

TEST_P(BackendContract, NoSubstepChangesNothing) {
  const Fixture f = test::random_fixture(5);
  load(f);
  ASSERT_TRUE(backend_->advance(0).ok());
  expect_equal(state(), f.state);
}

TEST_P(BackendContract, ALaterLoadForgetsTheFirst) {
  const Fixture large = test::random_fixture(6), small = drops({Vec3(0.1, 0.2, 0.3)});
  load(small);
  ASSERT_TRUE(backend_->advance(2).ok());
  const ParticleState alone = state();
  load(large);
  ASSERT_TRUE(backend_->advance(2).ok());
  load(small);
  ASSERT_TRUE(backend_->advance(2).ok());
  expect_equal(state(), alone);
}

TEST_P(BackendContract, NothingLoadedIsAnError) {
  Fields out;
  EXPECT_THROW((void)backend_->evaluate(out), BackendError);
  EXPECT_THROW((void)backend_->advance(1), BackendError);
}

TEST_P(BackendContract, AnEmptySceneRuns) {
  Fixture f = drops({});
  load(f);
  Fields out = Fields::unwritten(0, 0);
  EXPECT_TRUE(backend_->evaluate(out).ok());
  EXPECT_TRUE(backend_->advance(3).ok());
  EXPECT_EQ(state().size(), 0);
}

TEST_P(BackendContract, OneParticleFalls) {
  const Fixture f = drops({Vec3(0.1, 0.2, 0.3)});
  load(f);
  ASSERT_TRUE(backend_->advance(10).ok());
  const double dt = f.scene.time_step();
  EXPECT_NEAR(state().velocity(2, 0), -9.81 * 10 * dt, 1e-6 * 9.81 * 10 * dt);
  EXPECT_NEAR(state().position(2, 0), 0.3 - 9.81 * dt * dt * 55, 1e-6);
}

TEST_P(BackendContract, AWideSceneNeedsNoMoreMemoryAndNoNarrowerOne) {
  // Two particles within reach of each other 900 m from two others, far more cells than any table has.
  const double dx = drops({}).scene.particle_spacing;
  Fixture f = drops(
      {Vec3(0, 0, 0), Vec3(dx, 0, 0), Vec3(-900, 512, 700), Vec3(-900, 512, 700 + 0.9 * dx), Vec3(999, -999, -999)});
  f.scene.domain = {Vec3(-1000, -1000, -1000), Vec3(1000, 1000, 1000), {}};
  load(f);
  Fields out = Fields::unwritten(5, 0);
  ASSERT_TRUE(backend_->evaluate(out).ok());
  EXPECT_EQ(out.fluid_neighbor_count, (IdVector(5) << 1, 1, 1, 1, 0).finished());
  EXPECT_EQ(out.fluid_neighbor_id_sum, (IdVector(5) << 1, 0, 3, 2, 0).finished());
  EXPECT_TRUE(backend_->advance(3).ok());
  EXPECT_LT(backend_->neighbor_stats().device_bytes, 10'000'000);
}

TEST_P(BackendContract, ACrowdThatGathersIsSeenWhole) {
  // A shell that falls in on itself: lists grow between advances and in them, and whatever was recorded
  // with the short ones must not be used again.
  Fixture f = drops({});
  const double dx = f.scene.particle_spacing, H = f.scene.support_radius();
  std::vector<Vec3> points;
  for (int a = -3; a <= 3; ++a)
    for (int b = -3; b <= 3; ++b)
      for (int c = -3; c <= 3; ++c)
        if (a * a + b * b + c * c >= 4) points.push_back(1.05 * H * Vec3(a, b, c));
  f.scene.gravity.setZero();
  f.scene.domain = {Vec3::Constant(-5 * H), Vec3::Constant(5 * H), {}};
  f.state.position.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) f.state.position.col(static_cast<Eigen::Index>(i)) = points[i];
  const double dt = f.scene.time_step();
  f.state.velocity = -0.7 / (200 * dt) * f.state.position;
  f.state.quantise();
  const auto run = [&](Backend& backend) {
    backend.load(f.scene, sample_walls(f.scene), f.state);
    Fields out = Fields::unwritten(f.state.size(), 0);
    for (int k = 0; k < 10; ++k) {
      EXPECT_TRUE(backend.advance(20).ok());
      EXPECT_TRUE(backend.evaluate(out).ok());
    }
    ParticleState end;
    backend.read(end);
    return std::pair(end, out.fluid_neighbor_count.maxCoeff());
  };
  const auto [end, most] = run(*backend_);
  const auto reference = make_reference_backend();
  const auto [expected, most_expected] = run(*reference);
  EXPECT_GE(most_expected, 20);
  EXPECT_EQ(most, most_expected);
  EXPECT_LE((end.position - expected.position).cwiseAbs().maxCoeff(), 1e-3 * dx);
}

TEST_P(BackendContract, DensityAloneIsThatOfAllFields) {
  const Fixture f = test::random_fixture(5);
  const auto fields = [&](bool all, int substeps) {
    load(f);
    EXPECT_TRUE(backend_->advance(substeps).ok());
    Fields out = Fields::unwritten(f.state.size(), sample_walls(f.scene).size());
    EXPECT_TRUE((all ? backend_->evaluate(out) : backend_->evaluate_density(out)).ok());
    EXPECT_TRUE(backend_->advance(3).ok());  // what was looked at goes on as it was
    return std::pair(out, state());
  };
  for (const int substeps : {0, 5}) {
    const auto [all, after_all] = fields(true, substeps);
    const auto [alone, after_alone] = fields(false, substeps);
    ASSERT_TRUE(all.density.allFinite());
    EXPECT_TRUE(alone.density == all.density);
    EXPECT_TRUE(alone.pressure == all.pressure);
    expect_equal(after_alone, after_all);
  }
}

TEST_P(BackendContract, TwoParticlesInOnePlaceStayFinite) {
  const Fixture f = drops({Vec3(0.1, 0.2, 0.3), Vec3(0.1, 0.2, 0.3)});
  load(f);
  Fields out = Fields::unwritten(2, 0);
  ASSERT_TRUE(backend_->evaluate(out).ok());
  EXPECT_TRUE(out.acceleration.allFinite());
  EXPECT_EQ(out.fluid_neighbor_count[0], 1);
  EXPECT_TRUE(backend_->advance(1).ok());
}

TEST_P(BackendContract, AVelocityThatIsNoNumberIsReportedWithItsParticle) {
  Fixture f = test::random_fixture(8);
  f.state.velocity(1, 5) = nan;
  load(f);
  const Status status = backend_->advance(1);
  EXPECT_TRUE(status.bits & Status::non_finite) << describe(status);
  EXPECT_GE(status.particle, 0);
  EXPECT_EQ(status.substep, f.state.substep + 1);
}

TEST_P(BackendContract, APositionThatIsNoNumberIsReported) {
  Fixture f = drops({Vec3(0.1, 0.2, 0.3), Vec3(0.5, 0.2, 0.3)});
  f.state.position(0, 1) = nan;
  load(f);
  Fields out = Fields::unwritten(2, 0);
  const Status status = backend_->evaluate(out);
  EXPECT_TRUE(status.bits & Status::non_finite) << describe(status);
  EXPECT_EQ(status.particle, 1);
}

TEST_P(BackendContract, AParticleThatLeavesTheDomainIsReportedWhenItDoes) {
  Fixture f = drops({Vec3(0.1, 0.2, 0.3), Vec3(0.999, 0.2, 0.3)});
  const double dt = f.scene.time_step();
  f.state.velocity(0, 1) = 0.001 / (4.5 * dt);
  load(f);
  ASSERT_TRUE(backend_->advance(4).ok());
  const Status status = backend_->advance(3);
  EXPECT_TRUE(status.bits & Status::escaped) << describe(status);
  EXPECT_EQ(status.particle, 1);
  EXPECT_EQ(status.substep, f.state.substep + 5);
}

INSTANTIATE_TEST_SUITE_P(Backends, BackendContract, testing::ValuesIn(choices()), test::variant_name);

}  // namespace
}  // namespace decant
