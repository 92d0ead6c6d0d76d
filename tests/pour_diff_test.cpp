/// \file
/// Where two pours part is told by frame and field, and what differs is never told as the same.
#include "tools/pour/pour_diff.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "reference/error.hpp"
#include "tests/falling_points.hpp"
#include "tools/pour/pour.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>
#include <sstream>

namespace decant {
namespace {

namespace fs = std::filesystem;
using test::FallingPoints;

/// Falling points whose velocity changes by `kick` (m/s) at a substep.
class Kicked : public FallingPoints {
 public:
  Kicked(std::int64_t at, double kick) {
    before_advance = [this, at, kick](std::int64_t substep) {
      if (substep == at) state_.velocity.row(0).array() += kick;
    };
  }
};

class PourDifference : public testing::Test {
 protected:
  fs::path poured(const std::string& name, FallingPoints& backend, std::uint32_t seed = 0,
                  const Scene& scene = test::falling_points_scene()) {
    pour::Options options;
    options.out = folder_ / name;
    options.quiet = true;
    options.perturbation = seed;
    pour::run(scene, backend, options);
    return options.out;
  }
  fs::path poured(const std::string& name, std::uint32_t seed = 0) {
    FallingPoints backend;
    return poured(name, backend, seed);
  }
  TemporaryFolder folder_;
};

TEST_F(PourDifference, OfTwoPoursOfTheSameBitsIsNone) {
  const pour::Difference diff = pour::difference(poured("a"), poured("b"), {});
  EXPECT_EQ(diff.frames.size(), 13u);
  EXPECT_EQ(diff.frames_missing, 0);
  EXPECT_EQ(diff.first_difference(), -1);
  EXPECT_TRUE(diff.within());
  EXPECT_TRUE(pour::difference_line(diff).ends_with(": the same bits")) << pour::difference_line(diff);
}

TEST_F(PourDifference, IsFirstSeenWhereItArises) {
  // At substep 20, the 4th frame's; five substeps of dt later every particle is kick · 5 dt further.
  const double kick = 0.5;
  Kicked backend(20, kick);
  const Scene scene = test::falling_points_scene();
  const pour::Difference diff = pour::difference(poured("a"), poured("b", backend), {});
  EXPECT_EQ(diff.first_difference(), 5);
  EXPECT_EQ(diff.first_fields(), (std::vector<std::string>{"position", "velocity", "kinetic_energy"}));
  const pour::FrameDifference& f = diff.frames[5];
  const double way = kick * 5 * scene.time_step() / scene.particle_spacing;
  EXPECT_NEAR(f.distance[0], way, 1e-4 * way);
  EXPECT_NEAR(f.farthest, way, 1e-4 * way);
  EXPECT_NEAR(f.distance[1], kick, 1e-6);
  EXPECT_FALSE(diff.within());
  EXPECT_EQ(diff.beyond().frame, 5);
  EXPECT_EQ(diff.beyond().times, infinity) << "no spread is given";
}

TEST_F(PourDifference, IsWithinTheSpreadOfPoursThatDifferByTheirStartAlone) {
  const fs::path a = poured("a"), b = poured("b", 5), c = poured("c", 6), d = poured("d", 7);
  const pour::Difference alike = pour::difference(a, b, {c, d});
  EXPECT_EQ(alike.spread_pours, 3);
  EXPECT_EQ(alike.first_difference(), 0);
  EXPECT_TRUE(alike.within()) << pour::difference_text(alike);
  EXPECT_NE(pour::difference_line(alike).find("within the spread of 3 pours"), std::string::npos);
  Kicked backend(20, 0.05);
  const pour::Difference kicked = pour::difference(a, poured("kicked", backend), {c, d});
  EXPECT_FALSE(kicked.within());
  EXPECT_EQ(kicked.beyond().frame, 5);
  EXPECT_STREQ(pour::compared_fields[kicked.beyond().field], "position");
  EXPECT_GT(kicked.beyond().times, 3);
  EXPECT_TRUE(std::isfinite(kicked.beyond().times));
}

TEST(PourDiff, CountsTheLargestSpreadUntilThenAndNoNumberAsBeyondIt) {
  pour::Difference diff;
  diff.spread_pours = 2;
  diff.factor = 3;
  diff.frames.resize(3);
  for (std::size_t k = 0; k < 3; ++k) diff.frames[k].frame = static_cast<std::int64_t>(k);
  diff.frames[0].spread[1] = 2;
  diff.frames[1].distance[1] = 6;  // three times what was there a frame before
  EXPECT_TRUE(diff.within());
  diff.frames[2].distance[1] = 6.1;
  EXPECT_EQ(diff.beyond().frame, 2);
  EXPECT_EQ(diff.beyond().times, 6.1 / 2);
  // One particle elsewhere is nothing, four are more than three times that; energy is not judged.
  diff.frames[0].distance[4] = 3;
  diff.frames[0].distance[5] = 100;
  EXPECT_EQ(diff.beyond().frame, 2);
  diff.frames[0].distance[4] = 4;
  EXPECT_EQ(diff.beyond().frame, 0);
  diff.frames[0].distance[4] = diff.frames[0].distance[5] = 0;
  diff.frames[1].distance[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(diff.beyond().frame, 1);
  EXPECT_EQ(diff.beyond().field, 3u);
  EXPECT_EQ(diff.first_difference(), 1);
}

TEST_F(PourDifference, RefusesAnotherSceneAndAnotherNumberOfParticlesByName) {
  Scene other = test::falling_points_scene();
  other.fluid.viscosity = 0.06;
  FallingPoints one, two;
  const fs::path a = poured("a"), viscous = poured("viscous", one, 0, other);
  try {
    pour::difference(a, viscous, {});
    ADD_FAILURE() << "was not refused";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), (viscous / "frames.h5").string());
    EXPECT_EQ(error.value(), "fluid/viscosity = 0.06");
    EXPECT_NE(error.bound().find("0.05"), std::string::npos);
  }
  other = test::falling_points_scene();
  other.fills[0].box->max.z() += 0.01;
  const fs::path more = poured("more", two, 0, other);
  try {
    pour::difference(a, more, {});
    ADD_FAILURE() << "was not refused";
  } catch (const InputError& error) {
    EXPECT_EQ(error.value(), "216 particles");
    EXPECT_NE(error.bound().find("180 particles"), std::string::npos) << error.bound();
  }
  EXPECT_THROW(pour::difference(a, a, {more}), InputError);
  EXPECT_THROW(pour::difference(a, folder_ / "nowhere", {}), InputError);
}

TEST_F(PourDifference, ComparesTheFramesThatAnInterruptedPourHas) {
  pour::Options options;
  options.out = folder_ / "stopped";
  options.quiet = true;
  int frames = 0;
  options.stop = [&] { return ++frames == 4; };
  FallingPoints backend;
  EXPECT_FALSE(pour::run(test::falling_points_scene(), backend, options).finished);
  const pour::Difference diff = pour::difference(poured("a"), options.out, {});
  EXPECT_GE(diff.frames.size(), 4u);
  EXPECT_EQ(static_cast<std::int64_t>(diff.frames.size()) + diff.frames_missing, 13);
  EXPECT_TRUE(diff.within());
}

TEST_F(PourDifference, IsToldWithinAHundredColumnsAndInFullAsJson) {
  const pour::Difference diff = pour::difference(poured("a"), poured("b", 3), {poured("c", 4)});
  std::istringstream lines(pour::difference_text(diff));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  const auto json = nlohmann::json::parse(pour::difference_json(diff, 1));
  EXPECT_EQ(json["exit_status"], 1);
  EXPECT_EQ(json["by_frame"].size(), 13u);
  EXPECT_EQ(json["by_frame"][0]["distance"]["position"].get<double>(), diff.frames[0].distance[0]);
  EXPECT_EQ(json["first_difference"]["frame"], 0);
  EXPECT_EQ(json["units"]["position"], "dx");
}

TEST_F(PourDifference, KnowsAPourByItsFolderAndByItsFrames) {
  const fs::path a = poured("a");
  EXPECT_TRUE(pour::is_pour(a));
  EXPECT_TRUE(pour::is_pour(a / "frames.h5"));
  EXPECT_FALSE(pour::is_pour(a / "timeline.h5"));
  EXPECT_FALSE(pour::is_pour(a / "nowhere.h5"));
}

}  // namespace
}  // namespace decant
