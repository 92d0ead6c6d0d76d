/// \file
/// What a backend carries from one advance to the next is a function of the state that a checkpoint holds:
/// whoever loads that state goes on to the same bits as whoever never stopped.
#include "oracle/files/fixture_file.hpp"
#include "tests/backend_variants.hpp"
#include "tests/falling_points.hpp"
#include "tests/random_scene.hpp"

#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace decant {
namespace {

class Resume : public testing::TestWithParam<test::Variant> {
 protected:
  void SetUp() override {
    std::string why_not;
    if (!executor_available(GetParam().executor, &why_not)) GTEST_SKIP() << why_not;
  }
  std::unique_ptr<Backend> make() const { return test::make_variant(GetParam()); }

  /// `frames` advances of `substeps`, fields looked at after each as a pour does; another backend that is
  /// given the state before an advance must come to the same state and the same fields.
  void expect_same_bits(const Scene& scene, const ParticleState& start, int frames, int substeps) {
    const Walls walls = sample_walls(scene);
    const auto whole = make();
    whole->load(scene, walls, start);
    ParticleState before = start, now, resumed;
    for (int frame = 1; frame <= frames; ++frame) {
      Fields fields = Fields::unwritten(start.size(), walls.size()), again = fields;
      ASSERT_TRUE(whole->advance(substeps).ok());
      whole->read(now);
      ASSERT_TRUE(whole->evaluate(fields).ok());
      const auto other = make();
      other->load(scene, walls, before);
      ASSERT_TRUE(other->advance(substeps).ok());
      other->read(resumed);
      ASSERT_TRUE(other->evaluate(again).ok());
      ASSERT_EQ(resumed.substep, now.substep);
      ASSERT_TRUE(resumed.position == now.position) << scene.name << ", frame " << frame;
      ASSERT_TRUE(resumed.velocity == now.velocity) << scene.name << ", frame " << frame;
      EXPECT_TRUE(fields.density == again.density) << scene.name << ", frame " << frame;
      EXPECT_TRUE(fields.acceleration == again.acceleration) << scene.name << ", frame " << frame;
      before = now;
    }
    EXPECT_FALSE(before.position == start.position);
  }
};

/// Water that sloshes out of a cup which tilts.
TEST_P(Resume, EndsInTheSameBitsBesideWallsThatMove) {
  Scene scene = test::falling_points_scene(6);
  scene.containers[0].tilt->keys = {{0.0, 0.0}, {0.06, 1.2}};
  Fill water;
  water.container = "source";
  water.level = 0.08;
  scene.fills.push_back(water);
  scene.schedule.end = 0.06;
  scene.schedule.substeps_per_frame = substeps_for(scene);
  ASSERT_GE(scene.schedule.substeps_per_frame, 20);
  ParticleState start = initial_state(scene);
  start.velocity.row(0).setConstant(0.5);
  expect_same_bits(scene, start, 6, scene.schedule.substeps_per_frame);
}

TEST_P(Resume, EndsInTheSameBitsOnAPeriod) {
  const Fixture f = read_fixture(DECANT_SOURCE_DIR "/fixtures/hostile-periodic.h5");
  expect_same_bits(f.scene, f.state, 4, 20);
}

TEST_P(Resume, EndsInTheSameBitsInRandomScenes) {
  for (std::uint32_t seed = 300; seed < 306; ++seed) {
    const Fixture f = test::random_fixture(seed);
    expect_same_bits(f.scene, f.state, 3, 12);
  }
}

/// A recorded pour, where the state that was loaded lies far from where it ends.
TEST_P(Resume, EndsInTheSameBitsInTheStream) {
  if (GetParam().name.starts_with("brute") || GetParam().name.find("all-pairs") != std::string::npos)
    GTEST_SKIP() << "looks at every pair, which takes long; nothing of it is ordered by place";
  const Fixture f = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-stream.h5");
  expect_same_bits(f.scene, f.state, 2, f.scene.schedule.substeps_per_frame);
}

INSTANTIATE_TEST_SUITE_P(Backends, Resume, testing::ValuesIn(test::backend_variants()), test::variant_name);

}  // namespace
}  // namespace decant
