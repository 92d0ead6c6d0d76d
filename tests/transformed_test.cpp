/// \file
/// The same problem told otherwise has the same answer: the oracle itself must not care.
#include "gpu/backends.hpp"
#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "reference/error.hpp"
#include "reference/pose.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_file.hpp"

#include <gtest/gtest.h>

namespace decant {
namespace {

TEST(Transformed, ProblemsHaveTheAnswersOfTheProblem) {
  const Fixture f = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-splash.h5");
  const ReferenceSolution own = reference_solution(f.scene, sample_walls(f.scene), f.state);
  const auto problems = transformed_problems(f.scene, f.state);
  ASSERT_EQ(problems.size(), 3u);
  for (const TransformedProblem& p : problems) {
    const Walls walls = sample_walls(p.scene);
    ASSERT_EQ(walls.size(), sample_walls(f.scene).size()) << p.name;
    const ReferenceSolution its = reference_solution(p.scene, walls, p.state);
    // Rounded to fp32 elsewhere, particles are elsewhere; walls sampled in a turned frame too.
    const double allowed = p.name == "permuted" ? 1e-12 : p.name == "translated" ? 1e-3 : 0.02;
    EXPECT_NEAR(its.fields.density.sum() / own.fields.density.sum(), 1, allowed) << p.name;
    const double before = own.fields.acceleration.norm();
    EXPECT_NEAR(its.fields.acceleration.norm() / before, 1, 10 * allowed) << p.name;
  }
  EXPECT_EQ(problems[2].scene.containers[0].tilt->axis.x(), -f.scene.containers[0].tilt->axis.y());
}

TEST(Transformed, MoveAndTurnWhateverContainersDo) {
  Fixture f;
  f.scene = load_scene(DECANT_SOURCE_DIR "/fixtures/scenes/motion-sway.json");
  f.scene.containers[0].translation->keys.push_back({0.4, Vec3(0.01, 0.02, 0.03)});
  f.scene.containers[0].translation->velocity = {0.1, -0.2, 0.3};
  f.state.position = f.state.velocity = Eigen::Matrix3Xd::Zero(3, 1);
  const auto turned = [](const Vec3& x) { return Vec3(-x.y(), x.x(), x.z()); };
  const auto problems = transformed_problems(f.scene, f.state);
  const Vec3 local(0.01, 0.05, 0.02), way = Vec3::Constant(0.5);
  for (const double t : {0.0, 0.3, 0.7}) {
    const Pose pose = pose_at(f.scene.containers[0], t);
    const Vec3 x = pose.to_world(local), v = pose.velocity_at(x);
    const Pose moved = pose_at(problems[1].scene.containers[0], t), round = pose_at(problems[2].scene.containers[0], t);
    EXPECT_LT((moved.to_world(local) - x - way).norm(), 1e-14);
    EXPECT_LT((moved.velocity_at(x + way) - v).norm(), 1e-14);
    EXPECT_LT((round.to_world(turned(local)) - turned(x)).norm(), 1e-14);
    EXPECT_LT((round.velocity_at(turned(x)) - turned(v)).norm(), 1e-14);
  }
}

TEST(Checks, AreChosenByName) {
  EXPECT_EQ(all_checks().size(), 11u);
  EXPECT_EQ(parse_checks({"mass", "fields"}), (CheckSelection{"fields", "mass"}));
  try {
    parse_checks({"mas"});
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.key(), "--check");
    EXPECT_NE(error.bound().find("containment"), std::string::npos);
  }
}

TEST(Checks, AreMadeWhereTheyAreChosenAndNowhereElse) {
  const Fixture f = read_fixture(DECANT_SOURCE_DIR "/fixtures/pour-4k-rest.h5");
  const PreparedReference oracle = prepare_reference(f, {"conservation"});
  EXPECT_TRUE(oracle.transformed.empty());
  const auto backend = make_backend("hash", Executor::host, "");
  for (const CheckRow& row : run_checks(*backend, f, oracle, {"conservation"})) EXPECT_EQ(row.check, "conservation");
}

}  // namespace
}  // namespace decant
