/// \file
/// Phases follow from the tilt by the rule that phases.hpp states.
#include "tools/phases.hpp"
#include "reference/error.hpp"

#include <gtest/gtest.h>

namespace decant {
namespace {

Scene tilting_scene() {
  Scene scene;
  Container still, source;
  source.tilt = Tilt{Vec3::Zero(), Vec3::UnitY(), {{0.2, 0.0}, {2.2, 1.8}}};
  scene.containers = {still, source};
  scene.schedule.end = 3.2;
  scene.schedule.frames = 320;
  scene.schedule.substeps_per_frame = 10;  // dt = 1 ms
  return scene;
}

TEST(Phases, FollowFromTheTiltsFirstAndLastKey) {
  const Scene scene = tilting_scene();
  const std::vector<std::pair<std::string, std::int64_t>> expected = {
      {"start", 0},     {"settled", 200},  {"tilt-onset", 700}, {"stream", 1100},
      {"splash", 1300}, {"filling", 1700}, {"rest", 3200}};
  ASSERT_EQ(phase_names().size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_EQ(phase_names()[k], expected[k].first);
    EXPECT_EQ(parse_phase(scene, expected[k].first).substep, expected[k].second);
  }
}

TEST(Phases, TakeTheNearestSubstepToAGivenTime) {
  const Phase phase = parse_phase(tilting_scene(), "impact=1.2346");
  EXPECT_EQ(phase.name, "impact");
  EXPECT_EQ(phase.substep, 1235);
}

TEST(Phases, AreRefusedWhereTheyMakeNoSense) {
  const Scene scene = tilting_scene();
  for (const char* text : {"impact", "=1", "a/b=1", ".a=1", "a=", "a=1s", "a=-0.1", "a=3.3",
                           "a=nan", "a=inf", "a=1e400"}) {
    try {
      parse_phase(scene, text);
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_EQ(error.key(), "--phase") << text;
    }
  }
  Scene still = scene;
  still.containers.clear();
  EXPECT_THROW(parse_phase(still, "stream"), InputError);
  EXPECT_EQ(parse_phase(still, "rest").substep, 3200);
}

TEST(Phases, NameTheFilesTheyAreWrittenTo) {
  EXPECT_EQ(phase_file("out/pour-4k-{phase}.h5", "stream"), "out/pour-4k-stream.h5");
  EXPECT_EQ(phase_file("pour.h5", "stream"), "pour.h5");
}

}  // namespace
}  // namespace decant
