/// \file
/// Phases follow from the tilt by the rule that phases.hpp states.
#include "tools/common/phases.hpp"
#include "reference/error.hpp"

#include <gtest/gtest.h>

#include <cmath>

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
  const auto& keys = scene.containers[1].tilt->keys;
  const auto part_of_tilt = [&](double fraction) {
    return keys.front().time + fraction * (keys.back().time - keys.front().time);
  };
  const std::vector<std::pair<std::string, double>> expected = {{"start", 0},
                                                                {"settled", part_of_tilt(0)},
                                                                {"tilt-onset", part_of_tilt(0.25)},
                                                                {"stream", part_of_tilt(0.57)},
                                                                {"splash", part_of_tilt(0.65)},
                                                                {"filling", part_of_tilt(0.85)},
                                                                {"rest", scene.schedule.end}};
  ASSERT_EQ(phase_names().size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const auto& [name, time] = expected[k];
    EXPECT_EQ(phase_names()[k], name);
    EXPECT_NEAR(phase_time(scene, name), time, 1e-12) << name;
    EXPECT_EQ(parse_phase(scene, name).substep, std::llround(time / scene.time_step())) << name;
  }
}

TEST(Phases, TakeTheNearestSubstepToAGivenTime) {
  const Phase phase = parse_phase(tilting_scene(), "impact=1.2346");
  EXPECT_EQ(phase.name, "impact");
  EXPECT_EQ(phase.substep, 1235);
}

TEST(Phases, AreRefusedWhereTheyMakeNoSense) {
  const Scene scene = tilting_scene();
  for (const char* text :
       {"impact", "=1", "a/b=1", ".a=1", "a=", "a=1s", "a=-0.1", "a=3.3", "a=nan", "a=inf", "a=1e400"}) {
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
