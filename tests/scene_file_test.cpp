/// \file
/// Scene files: what is refused and in which words, what is shipped, and that a written scene reads
/// back to the same bits.
#include "reference/scene_file.hpp"

#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/scene_format.hpp"
#include "reference/scene_schema.hpp"
#include "tests/file_bytes.hpp"
#include "tests/scene_folder.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <set>

namespace decant {
namespace {

using nlohmann::json;

using test::scenes;

json valid_scene() {
  return json::parse(R"({
    "decant_scene": 1, "name": "two-cups", "particle_spacing": 0.004,
    "fluid": {"rest_density": 1000, "sound_speed": 10, "viscosity": 0.05},
    "domain": {"min": [-0.5, -0.5, -0.1], "max": [0.5, 0.5, 0.5]},
    "floor": {"height": 0},
    "contact": {"friction": 0.5},
    "containers": [
      {"name": "source",
       "cup": {"inner_radius": 0.03, "inner_height": 0.06, "wall_thickness": 0.009},
       "origin": [-0.1, 0, 0.1],
       "tilt": {"pivot": [-0.07, 0, 0.16], "axis": [0, 1, 0],
                "keys": [{"time": 0.1, "angle_deg": 0}, {"time": 1, "angle_deg": 90}]}},
      {"name": "tank",
       "tank": {"size": [0.2, 0.1, 0.1], "wall_thickness": 0.01, "open": ["+z"]},
       "origin": [0, -0.05, 0.01]},
      {"name": "peg",
       "revolved": {"profile": [[0, 0], [0.01, 0], [0.01, 0.02], [0, 0.02]],
                    "wall_thickness": 0.01},
       "origin": [-0.3, 0, 0]},
      {"name": "step",
       "boxes": {"cavity": {"min": [0, 0, 0.02], "max": [0.05, 0.05, 0.05]},
                 "solid": [{"min": [0, 0, 0], "max": [0.05, 0.05, 0.02]}],
                 "wall_thickness": 0.02},
       "origin": [-0.3, 0.2, 0]}],
    "fill": [{"container": "source", "level": 0.05},
             {"box": {"min": [0.3, 0.2, 0.1], "max": [0.35, 0.25, 0.15]}, "velocity": [1, 0, 0]}],
    "time": {"end": 1, "frames": 10}
  })");
}

/// Runs `load`, which must refuse, and returns how.
template <typename Load>
InputError refusal_of(Load load) {
  try {
    load();
  } catch (const InputError& error) {
    return error;
  }
  ADD_FAILURE() << "was not refused";
  return {"", "", "", ""};
}

/// One wrong scene: `text` replaces what stands at `pointer` ("" removes it), and the refusal names
/// `key` and holds `value` and `bound`.
struct Malformed {
  const char *pointer, *text, *key, *value, *bound;
};

void PrintTo(const Malformed& scene, std::ostream* out) {
  *out << scene.pointer << " = " << (*scene.text ? scene.text : "(removed)");
}

const Malformed malformed[] = {
    {"/gravty", "[0, 0, 1]", "gravty", "[0,0,1]", "known keys here: decant_scene, name"},
    {"/fluid/viscosty", "1", "fluid.viscosty", "1", "known keys here: rest_density"},
    {"/domain/periodc", "[]", "domain.periodc", "[]", "known keys here: min, max, periodic"},
    {"/floor/level", "1", "floor.level", "1", "known keys here: height"},
    {"/contact/bounce", "1", "contact.bounce", "1", "known keys here: distance_ratio"},
    {"/containers/0/shape", "1", "containers[0].shape", "1", "known keys here: name, cup"},
    {"/containers/0/cup/height", "1", "containers[0].cup.height", "1", "inner_height"},
    {"/containers/1/tank/depth", "1", "containers[1].tank.depth", "1", "known keys here: size"},
    {"/containers/2/revolved/r", "1", "containers[2].revolved.r", "1", "profile"},
    {"/containers/3/boxes/open", "1", "containers[3].boxes.open", "1", "known keys here: cavity"},
    {"/containers/0/tilt/angle", "1", "containers[0].tilt.angle", "1", "pivot, axis, keys"},
    {"/containers/0/tilt/keys/1/deg", "1", "containers[0].tilt.keys[1].deg", "1", "angle_deg"},
    {"/fill/1/box/size", "1", "fill[1].box.size", "1", "known keys here: min, max"},
    {"/fill/0/height", "1", "fill[0].height", "1", "known keys here: container, level"},
    {"/time/dt", "1e-4", "time.dt", "0.0001", "known keys here: end, frames"},
    {"/a b", "1", "\"a b\"", "1", "known keys here: decant_scene"},
    {"/name", "", "name", "missing", "a required key"},
    {"/fluid", "", "fluid", "missing", "a required key"},
    {"/fluid/viscosity", "", "fluid.viscosity", "missing", "a required key"},
    {"/fill", "", "fill", "missing", "a required key"},
    {"/containers/0/tilt/pivot", "", "containers[0].tilt.pivot", "missing", "a required key"},
    {"/containers/0/tilt/keys/0/time", "", "containers[0].tilt.keys[0].time", "missing", "time"},
    {"/decant_scene", "2", "decant_scene", "2", "the integer 1"},
    {"/decant_scene", "1.0", "decant_scene", "1.0", "the integer 1"},
    {"/name", "\"\"", "name", "\"\"", "1 to 64 letters"},
    {"/name", "\"../up\"", "name", "\"../up\"", "1 to 64 letters"},
    {"/name", "7", "name", "7", "1 to 64 letters"},
    {"/name", "\".\"", "name", "\".\"", "the first no '.'"},
    {"/containers/0/name", "\".\"", "containers[0].name", "\".\"", "the first no '.'"},
    {"/containers/0/name", "\"..\"", "containers[0].name", "\"..\"", "the first no '.'"},
    {"/containers/0/name", "\".hidden\"", "containers[0].name", "\".hidden\"", "the first no '.'"},
    {"/containers/0/name", "\"-rf\"", "containers[0].name", "\"-rf\"", "and no '-'"},
    {"/containers/0/name", "\"a/b\"", "containers[0].name", "\"a/b\"", "1 to 64 letters"},
    {"/containers/0/name", "\"a:b\"", "containers[0].name", "\"a:b\"", "1 to 64 letters"},
    {"/containers/0/name", "\"cup \"", "containers[0].name", "\"cup \"", "1 to 64 letters"},
    {"/containers/0/name", "\"a\\u0007\"", "containers[0].name", "\"a\\u0007\"", "1 to 64 letters"},
    {"/particle_spacing", "0", "particle_spacing", "0", "[1e-06, 1000.0]"},
    {"/particle_spacing", "-0.1", "particle_spacing", "-0.1", "[1e-06, 1000.0]"},
    {"/particle_spacing", "\"4 mm\"", "particle_spacing", "\"4 mm\"", "a number in"},
    {"/particle_spacing", "null", "particle_spacing", "null", "a number in"},
    {"/kernel", "\"gauss\"", "kernel", "\"gauss\"", "cubic_spline, wendland_c2, mueller2003"},
    {"/kernel", "1", "kernel", "1", "one of cubic_spline"},
    {"/support_ratio", "1.4", "support_ratio", "1.4", "[1.5, 5.0]"},
    {"/support_ratio", "5.1", "support_ratio", "5.1", "[1.5, 5.0]"},
    {"/mass_ratio", "0.4", "mass_ratio", "0.4", "[0.5, 2.0]"},
    {"/fluid", "[]", "fluid", "[]", "an object {...} (fluid)"},
    {"/fluid/rest_density", "0", "fluid.rest_density", "0", "(0.0, 1000000.0]"},
    {"/fluid/sound_speed", "-10", "fluid.sound_speed", "-10", "(0.0, 1000000.0]"},
    {"/fluid/eos_exponent", "2", "fluid.eos_exponent", "2", "7 or 1"},
    {"/fluid/allow_tension", "0", "fluid.allow_tension", "0", "true or false"},
    {"/fluid/viscosity", "-0.05", "fluid.viscosity", "-0.05", "[0.0, 1000000.0]"},
    {"/fluid/viscosity", "true", "fluid.viscosity", "true", "a number in"},
    {"/fluid/wall_viscosity", "-1", "fluid.wall_viscosity", "-1", "[0.0, 1000000.0]"},
    {"/gravity", "-9.81", "gravity", "-9.81", "an array"},
    {"/gravity", "[0, -9.81]", "gravity", "[0,-9.81]", "an array of 3 elements, not 2"},
    {"/gravity", "[0, 0, \"down\"]", "gravity[2]", "\"down\"", "a number in"},
    {"/domain/max", "[0.5, -0.5, 0.5]", "domain.max[1]", "-0.5", "greater than min, which is -0.5"},
    {"/domain/min", "[0, 0, 1e5]", "domain.min[2]", "100000.0", "[-10000.0, 10000.0]"},
    {"/domain/periodic", "[\"w\"]", "domain.periodic[0]", "\"w\"", "one of x, y, z"},
    {"/domain/periodic", "[\"x\", \"x\"]", "domain.periodic[1]", "\"x\"", "each axis once"},
    {"/domain/periodic", "[\"y\"]", "containers[1].tank.open", "[\"+z\"]", "both -y and +y"},
    {"/floor", "0", "floor", "0", "an object {...} (floor)"},
    {"/contact/distance_ratio", "0.6", "contact.distance_ratio", "0.6", "[0.0, 0.5]"},
    {"/contact/restitution", "1.5", "contact.restitution", "1.5", "[0.0, 1.0]"},
    {"/contact/friction", "-1", "contact.friction", "-1", "[0.0, 1000000.0]"},
    {"/wall_layers", "0", "wall_layers", "0", "an integer in [1, 8]"},
    {"/wall_layers", "1.5", "wall_layers", "1.5", "an integer in [1, 8]"},
    {"/containers", "{}", "containers", "{}", "an array"},
    {"/containers/1/name", "\"source\"", "containers[1].name", "\"source\"", "containers[0]"},
    {"/containers/0/cup", "", "containers[0]", "{", "exactly one of cup, tank, revolved, boxes"},
    {"/containers/1/cup", "{}", "containers[1]", "{", "exactly one of cup, tank, revolved, boxes"},
    {"/containers/0/cup/inner_radius", "0", "containers[0].cup.inner_radius", "0", "(0.0, "},
    {"/containers/0/cup/wall_thickness", "-1", "containers[0].cup.wall_thickness", "-1", "(0.0, "},
    {"/containers/0/origin", "[0, 0]", "containers[0].origin", "[0,0]", "3 elements, not 2"},
    {"/containers/1/tank/size", "[1, 1, 0]", "containers[1].tank.size[2]", "0", "(0.0, "},
    {"/containers/1/tank", R"({"size": [0.2, 0.1, 0.1], "wall_thickness": 0.15, "open": ["-y", "+y"]})",
     "containers[1].tank.size[1]", "0.1", "where both faces are open"},
    {"/containers/1/tank/open", "[\"z\"]", "containers[1].tank.open[0]", "\"z\"", "-x, +x, -y"},
    {"/containers/1/tank/open", "[\"+z\", \"+z\"]", "containers[1].tank.open[1]", "\"+z\"", "once"},
    {"/containers/1/tank/open", "[\"-x\", \"+x\", \"-y\", \"+y\", \"-z\", \"+z\"]", "containers[1].tank.open",
     "[\"-x\"", "0 to 5 elements, not 6"},
    {"/containers/2/revolved/profile", "[[0, 0], [1, 1]]", "containers[2].revolved.profile", "[[0,0]",
     "3 to 1000 elements, not 2"},
    {"/containers/2/revolved/profile/1", "[-1, 0]", "containers[2].revolved.profile[1][0]", "-1", "[0.0, "},
    {"/containers/2/revolved/profile", "[[0, 0], [0, 1], [1, 1], [1, 0]]", "containers[2].revolved.profile", "[[0,0]",
     "solid on its left"},
    {"/containers/2/revolved/profile", "[[0, 0], [1, 1], [1, 0], [0, 1.5]]", "containers[2].revolved.profile[2]",
     "[1,0]", "does not cross itself"},
    {"/containers/2/revolved/profile/2", "[0.01, 0]", "containers[2].revolved.profile[1]", "[0.01,0]",
     "different from the point after it"},
    {"/containers/3/boxes/solid", "[]", "containers[3].boxes.solid", "[]", "1 to 1000 elements"},
    {"/containers/3/boxes/solid/0/max/2", "0.01", "containers[3].boxes.solid[0]", "{",
     "no thinner than wall_thickness, which is 0.02"},
    {"/containers/3/boxes/cavity/max/0", "0", "containers[3].boxes.cavity.max[0]", "0", "greater than min"},
    {"/containers/0/tilt/axis", "[0, 0, 0]", "containers[0].tilt.axis", "[0,0,0]", "longer than"},
    {"/containers/0/tilt/keys", "[]", "containers[0].tilt.keys", "[]", "1 to 10000 elements"},
    {"/containers/0/tilt/keys/1/time", "0.1", "containers[0].tilt.keys[1].time", "0.1",
     "later than the key before it, at 0.1"},
    {"/containers/0/tilt/keys/0/time", "-1", "containers[0].tilt.keys[0].time", "-1", "[0.0, "},
    {"/containers/0/tilt/keys/0/angle", "1", "containers[0].tilt.keys[0]", "{", "exactly one of"},
    {"/containers/0/tilt/keys/0/angle_deg", "1000001", "containers[0].tilt.keys[0].angle_deg", "1000001",
     "[-1000000.0, 1000000.0]"},
    {"/containers/0/tilt/keys", "", "containers[0].tilt", "{", "at least one of keys, rate, oscillation"},
    {"/containers/0/tilt/rate", "[1]", "containers[0].tilt.rate", "[1]", "a number in"},
    {"/containers/0/tilt/oscillation", R"({"amplitude": 1})", "containers[0].tilt.oscillation.frequency", "missing",
     "a required key"},
    {"/containers/0/tilt/oscillation", R"({"amplitude": 1, "frequency": 0})",
     "containers[0].tilt.oscillation.frequency", "0", "(0.0, "},
    {"/containers/0/tilt/oscillation", R"({"amplitude": [1, 0, 0], "frequency": 1})",
     "containers[0].tilt.oscillation.amplitude", "[1,0,0]", "a number in"},
    {"/containers/0/translation", "{}", "containers[0].translation", "{}",
     "at least one of keys, velocity, oscillation"},
    {"/containers/0/translation", R"({"keys": [{"time": 1, "offset": [0, 0]}]})",
     "containers[0].translation.keys[0].offset", "[0,0]", "3 elements, not 2"},
    {"/containers/0/translation", R"({"keys": [{"time": 1, "offset": [0, 0, 0]}, {"time": 1, "offset": [0, 0, 1]}]})",
     "containers[0].translation.keys[1].time", "1", "later than the key before it, at 1.0"},
    {"/containers/0/translation", R"({"velocity": 1})", "containers[0].translation.velocity", "1", "an array"},
    {"/containers/0/translation", R"({"oscillation": {"amplitude": 1, "frequency": 1}})",
     "containers[0].translation.oscillation.amplitude", "1", "an array"},
    {"/fill/0/around", "[\"cup\"]", "fill[0].around[0]", "\"cup\"", "source, tank, peg, step"},
    {"/fill/0/around", "[\"source\"]", "fill[0].around[0]", "\"source\"",
     "another container than the one that is filled"},
    {"/fill/0/around", "[\"peg\", \"peg\"]", "fill[0].around[1]", "\"peg\"", "each container once"},
    {"/containers/0/surface_velocity", "[1, 0]", "containers[0].surface_velocity", "[1,0]", "3 elements, not 2"},
    {"/fill/1/ball", "{}", "fill[1]", "{", "exactly one of level, box, ball, rod"},
    {"/fill/1", R"({"ball": {"center": [0, 0, 0.3], "radius": 0}})", "fill[1].ball.radius", "0", "(0.0, "},
    {"/fill/1", R"({"rod": {"center": [0, 0, 0.3], "radius": 0.1, "axis": "w", "length": 1}})", "fill[1].rod.axis",
     "\"w\"", "one of x, y, z"},
    {"/fill/1", R"({"rod": {"center": [0, 0, 0.3], "radius": 0.1, "axis": "x"}})", "fill[1].rod.length", "missing",
     "a required key"},
    {"/fill/1/velocity_gradient", R"({"matrix": [[1, 0, 0]], "about": [0, 0, 0]})", "fill[1].velocity_gradient.matrix",
     "[[1", "3 elements, not 1"},
    {"/fill/1/velocity_gradient", R"({"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]})", "fill[1].velocity_gradient.about",
     "missing", "a required key"},
    {"/fill", "[]", "fill", "[]", "1 to 1000 elements, not 0"},
    {"/fill/0/container", "\"cup\"", "fill[0].container", "\"cup\"", "source, tank, peg, step"},
    {"/fill/0/level", "-0.01", "fill[0].level", "-0.01", "(0.0, "},
    {"/fill/0/level", "", "fill[0]", "{\"container\":\"source\"}", "exactly one of level, box, ball, rod"},
    {"/fill/0/container", "", "fill[0].level", "0.05", "because no container is named"},
    {"/fill/1/box/max/2", "0.1", "fill[1].box.max[2]", "0.1", "greater than min, which is 0.1"},
    {"/fill/1/velocity", "[1]", "fill[1].velocity", "[1]", "3 elements, not 1"},
    {"/time/end", "0", "time.end", "0", "(0.0, "},
    {"/time/frames", "0", "time.frames", "0", "an integer in [1, 1000000]"},
    {"/time/frames", "18446744073709551615", "time.frames", "18446744073709551615", "an integer in"},
    {"/time/courant", "0.41", "time.courant", "0.41", "(0.0, 0.4]"},
    {"/time/courant", "0", "time.courant", "0", "(0.0, 0.4]"},
    {"/time/max_speed", "-2", "time.max_speed", "-2", "(0.0, "},
    {"/time/substeps_per_frame", "0", "time.substeps_per_frame", "0", "an integer in [1, "},
    {"/time/substeps_derived", "false", "time.substeps_derived", "false", "is missing"},
};

TEST(SceneFile, AcceptsTheSceneThatTheMalformedOnesDifferFrom) {
  EXPECT_NO_THROW(parse_scene(valid_scene().dump(), "valid.json"));
}

class MalformedScene : public testing::TestWithParam<Malformed> {};

TEST_P(MalformedScene, IsRefusedWithFileKeyValueAndBound) {
  const Malformed& wrong = GetParam();
  json scene = valid_scene();
  const json::json_pointer at(wrong.pointer);
  if (*wrong.text) scene[at] = json::parse(wrong.text);
  else scene[at.parent_pointer()].erase(at.back());
  const InputError error = refusal_of([&] { parse_scene(scene.dump(), "wrong.json"); });
  EXPECT_EQ(error.file(), "wrong.json");
  EXPECT_EQ(error.key(), wrong.key);
  EXPECT_EQ(error.value().substr(0, std::strlen(wrong.value)), wrong.value);
  EXPECT_NE(error.bound().find(wrong.bound), std::string::npos) << error.bound();
  const std::string message = error.what();
  for (const std::string& part : {error.file(), error.key(), error.value(), error.bound()})
    EXPECT_NE(message.find(part), std::string::npos) << message;
}

INSTANTIATE_TEST_SUITE_P(SceneFile, MalformedScene, testing::ValuesIn(malformed));

TEST(SceneFile, RefusesAnUnknownKeyAndNamesItAndTheKnownOnes) {
  json scene = valid_scene();
  scene["containers"][0]["cup"]["radius"] = 1;
  const InputError error = refusal_of([&] { parse_scene(scene.dump(), "typo.json"); });
  EXPECT_STREQ(error.what(),
               "typo.json: containers[0].cup.radius = 1: no such key; known keys here: "
               "inner_radius, inner_height, wall_thickness");
}

TEST(SceneFile, RefusesAKeyThatStandsTwiceInOneObject) {
  const InputError error =
      refusal_of([] { parse_scene(R"({"fill": [{}, {"box": {"min": 1, "min": 2}}]})", "twice.json"); });
  EXPECT_EQ(error.key(), "fill[1].box.min");
  EXPECT_EQ(error.value(), "given twice");
}

TEST(SceneFile, NamesTheEmptyKey) {
  for (const char* text : {R"({"": 1, "": 2})", R"({"": 1e999})", R"({"": ]})"})
    EXPECT_EQ(refusal_of([&] { parse_scene(text, "empty.json"); }).key(), R"("")") << text;
}

TEST(SceneFile, NamesLineAndColumnOfBadSyntax) {
  const InputError error =
      refusal_of([] { parse_scene("{\n  // half a scene\n  \"fluid\": {\"a\": 1,]\n}", "s.json"); });
  EXPECT_EQ(error.file(), "s.json");
  EXPECT_EQ(error.key(), "fluid.a");
  EXPECT_EQ(error.value(), "line 3, column 20");
  EXPECT_NE(error.bound().find("valid JSON"), std::string::npos);
}

TEST(SceneFile, RefusesNumbersThatNoDoubleHolds) {
  const InputError huge = refusal_of([] { parse_scene(R"({"fluid": {"viscosity": 1e999}})", "s.json"); });
  EXPECT_EQ(huge.key(), "fluid.viscosity");
  EXPECT_EQ(huge.value(), "1e999");
  for (const char* text : {R"({"gravity": [0, 0, NaN]})", R"({"gravity": [0, 0, -Infinity]})"})
    EXPECT_EQ(refusal_of([&] { parse_scene(text, "s.json"); }).key(), "gravity[2]");
}

TEST(SceneFile, RefusesWhatIsNoObjectAtAll) {
  for (const char* text : {"", "[]", "7", "\"scene\"", "null", "{", "\xff\xfe", "// nothing\n"})
    EXPECT_EQ(refusal_of([&] { parse_scene(text, "s.json"); }).file(), "s.json") << text;
}

TEST(SceneFile, RefusesAFileThatIsMissingOrADirectory) {
  for (const auto& path : {scenes / "absent.json", scenes})
    EXPECT_EQ(refusal_of([&] { load_scene(path); }).file(), path.string());
}

TEST(SceneFile, TakesDegreesAndRadians) {
  json scene = valid_scene();
  auto& keys = scene["containers"][0]["tilt"]["keys"];
  keys = {{{"time", 0.0}, {"angle_deg", 180.0}}, {{"time", 1.0}, {"angle", 3.0}}};
  const auto tilt = *parse_scene(scene.dump(), "s.json").containers[0].tilt;
  EXPECT_DOUBLE_EQ(tilt.keys[0].angle, std::numbers::pi);
  EXPECT_EQ(tilt.keys[1].angle, 3.0);
}

TEST(SceneFile, ADrumNeedsNothingButItsRate) {
  json scene = valid_scene();
  scene["containers"][0]["tilt"] = {{"pivot", {0, 0, 0}}, {"axis", {0, 2, 0}}, {"rate", -3.5}};
  const auto tilt = *parse_scene(scene.dump(), "s.json").containers[0].tilt;
  ASSERT_EQ(tilt.keys.size(), 1u);
  EXPECT_EQ(tilt.keys[0].time, 0);
  EXPECT_EQ(tilt.keys[0].angle, 0);
  EXPECT_EQ(tilt.rate, -3.5);
  EXPECT_EQ(tilt.axis, Vec3::UnitY());
}

TEST(SceneFile, WallViscosityIsTwiceTheViscosityUnlessGiven) {
  json scene = valid_scene();
  EXPECT_EQ(parse_scene(scene.dump(), "s.json").fluid.wall_viscosity, 2 * 0.05);
  scene["fluid"]["wall_viscosity"] = 0;
  EXPECT_EQ(parse_scene(scene.dump(), "s.json").fluid.wall_viscosity, 0.0);
}

TEST(ShippedScenes, AllLoad) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(scenes)) {
    if (entry.path().filename() == "scene.schema.json") continue;
    ++count;
    EXPECT_NO_THROW({
      const Scene scene = load_scene(entry.path());
      EXPECT_EQ(scene.name, entry.path().stem().string());
      EXPECT_GT(initial_state(scene).size(), 0);
    }) << entry.path();
  }
  EXPECT_GE(count, 6);
}

TEST(ShippedScenes, PoursHoldTheParticlesTheirNamesSay) {
  const auto count = [](const char* file) {
    return static_cast<double>(initial_state(load_scene(scenes / file)).size());
  };
  EXPECT_NEAR(count("pour-4k.json"), 4000, 0.02 * 4000);
  EXPECT_NEAR(count("pour-56k.json"), 56000, 0.01 * 56000);
}

TEST(ShippedScenes, PoursDifferInSpacingAlone) {
  const auto read = [](const char* file) {
    std::ifstream in(scenes / file);
    json scene = json::parse(in, nullptr, true, true);
    scene.erase("name");
    EXPECT_EQ(scene.erase("particle_spacing"), 1u);
    return scene;
  };
  EXPECT_EQ(read("pour-4k.json"), read("pour-56k.json"));
}

using test::bytes_of;

TEST(SceneSchema, IsTheOneThatTheFormatGives) {
  EXPECT_EQ(bytes_of(scenes / "scene.schema.json"), scene_schema())
      << "ci/build --only decant_scene_schema dev && "
         "build/dev/bin/decant_scene_schema > fixtures/scenes/scene.schema.json";
}

TEST(SceneSchema, DefinesWhatItRefersTo) {
  const json schema = json::parse(scene_schema());
  EXPECT_EQ(schema["$defs"].size(), scene_format().size() - 1) << "an object stands twice";
  std::set<std::string> used;
  const json values = schema.flatten();
  for (const auto& [path, value] : values.items())
    if (path.ends_with("/$ref")) used.insert(value.get<std::string>().substr(std::strlen("#/$defs/")));
  for (const auto& [name, definition] : schema["$defs"].items()) EXPECT_EQ(used.erase(name), 1u) << name;
  EXPECT_EQ(used, std::set<std::string>{});
}

TEST(SceneExample, HasEveryKeyOfTheFormat) {
  const std::string text = bytes_of(scenes / "example.json");
  for (const ObjectFormat& object : scene_format())
    for (const Member& member : object.members)
      EXPECT_NE(text.find('"' + member.key + '"'), std::string::npos) << object.name << "." << member.key;
}

/// Calls `visit` with the pointer and the path, as messages have it, of every value in objects below `at`.
template <typename Visit>
void visit_members(const json& at, const json::json_pointer& pointer, const std::string& path, const Visit& visit) {
  if (at.is_object()) {
    for (const auto& [key, value] : at.items()) {
      const std::string below = path.empty() ? key : path + "." + key;
      visit(pointer / key, below);
      visit_members(value, pointer / key, below, visit);
    }
  } else if (at.is_array()) {
    for (std::size_t i = 0; i < at.size(); ++i)
      visit_members(at[i], pointer / i, path + "[" + std::to_string(i) + "]", visit);
  }
}

/// A key that the reader never looks at would pass whatever stands there.
TEST(SceneExample, EveryKeyOfItIsRead) {
  const json example = json::parse(bytes_of(scenes / "example.json"), nullptr, true, true);
  int keys = 0;
  visit_members(example, json::json_pointer(), "", [&](const json::json_pointer& at, const std::string& path) {
    json scene = example;
    scene[at] = nullptr;
    const InputError error = refusal_of([&] { parse_scene(scene.dump(), "null.json"); });
    EXPECT_EQ(error.key(), path);
    EXPECT_EQ(error.value(), "null") << path;
    ++keys;
  });
  EXPECT_GT(keys, 100);
}

}  // namespace
}  // namespace decant
