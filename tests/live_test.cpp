/// \file
/// `decant live` without a run: who is served, what a picture says, what a change of the scene is.
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/pose.hpp"
#include "reference/sampling.hpp"
#include "tests/live/cups.hpp"
#include "tools/live/colors.hpp"
#include "tools/live/page.hpp"
#include "tools/live/picture.hpp"
#include "tools/live/requests.hpp"
#include "tools/live/scores.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

namespace decant::live {
namespace {

using nlohmann::ordered_json;
using test::cups;
constexpr double degree = std::numbers::pi / 180;

double angle_of(const LiveScene& scene, std::int64_t substep) {
  return tilt_at(*scene.running().containers.at(0).tilt, scene.running().time_at(substep)).angle;
}

// --- who is served -----------------------------------------------------------------------------------------------

TEST(LiveRequests, ServesWhoeverKnowsTheToken) {
  const Requests requests("secret");
  const auto asks = [&](const std::string& target, const std::string& host = "127.0.0.1:4000",
                        const std::string& method = "GET") {
    return requests.answer({method, target, host, "", false}).status;
  };
  EXPECT_EQ(asks("/secret/"), 200);
  EXPECT_EQ(asks("/secret/live.js"), 200);
  EXPECT_EQ(asks("/secret/?x=1", "localhost:4000"), 200);
  EXPECT_EQ(asks("/secret/", "[::1]:4000"), 200);
  EXPECT_EQ(asks("/secret/", "127.0.0.1"), 200);
  EXPECT_EQ(asks("/secret/", "127.0.0.1:4000", "HEAD"), 200);
  for (const char* target : {"/", "/live.js", "/Secret/", "/secre/", "/secret", "/secrets/", "/secret/none",
                             "/secret/live.js/", "", "secret/", "//secret/", "/x/secret/"})
    EXPECT_EQ(asks(target), 404) << target;
  for (const char* host : {"", "example.org", "127.0.0.1.example.org", "localhost.example.org:4000", "127.0.0.1:40x",
                           "10.0.0.1:4000", "localhost:4000@example.org"})
    EXPECT_EQ(asks("/secret/", host), 403) << host;
  EXPECT_EQ(asks("/secret/", "127.0.0.1:4000", "POST"), 405);
}

TEST(LiveRequests, OpensSocketsForItsOwnPageAndForPrograms) {
  const Requests requests("secret");
  const auto asks = [&](const std::string& origin, const std::string& target = "/secret/socket", bool upgrade = true) {
    return requests.answer({"GET", target, "localhost:4000", origin, upgrade});
  };
  EXPECT_TRUE(asks("http://localhost:4000").socket);
  EXPECT_TRUE(asks("").socket);
  for (const char* origin : {"http://localhost:4001", "http://127.0.0.1:4000", "https://localhost:4000", "null",
                             "http://localhost:4000.example.org", "http://example.org"}) {
    EXPECT_FALSE(asks(origin).socket) << origin;
    EXPECT_EQ(asks(origin).status, 403) << origin;
  }
  EXPECT_EQ(asks("", "/guess/socket").status, 404);
  EXPECT_EQ(asks("", "/secret/socket", false).status, 426);
}

TEST(LiveRequests, TokensDiffer) {
  std::set<std::string> tokens;
  for (int k = 0; k < 100; ++k) tokens.insert(Requests::new_token());
  EXPECT_EQ(tokens.size(), 100u);
  EXPECT_EQ(tokens.begin()->size(), 32u);
}

TEST(LivePage, HoldsItsFiles) {
  std::set<std::string_view> names;
  for (const PageFile& file : page_files()) {
    EXPECT_GT(file.bytes.size(), 100u) << file.name;
    names.insert(file.name);
  }
  const std::string_view index = page_files().at(0).bytes;
  for (const char* used : {"three.js", "orbit-controls.js", "chart.js", "view.js", "history.js", "curves.js", "live.js",
                           "live.css", "licenses.txt"}) {
    EXPECT_TRUE(names.contains(used)) << used;
    EXPECT_NE(index.find(fmt::format("\"{}\"", used)), index.npos) << used;
  }
  EXPECT_EQ(index.find("http"), index.npos) << "nothing from outside";
}

// --- a picture ---------------------------------------------------------------------------------------------------

TEST(LivePicture, SaysWherePosesAndParticlesAre) {
  const Scene scene = cups().running();
  ParticleState state = initial_state(scene);
  state.substep = 5000;
  Colors colors = scale_of(Quantity::speed, scene);
  state.velocity.setZero();
  state.velocity(2, 3) = -0.5 * colors.largest;
  state.velocity(0, 4) = 2 * colors.largest;
  color(colors, state, {});
  colors.values[5] = std::nan("");
  const Message bytes = picture_of(scene, state, colors);
  const std::size_t head = 14 + 12 * scene.containers.size(), n = static_cast<std::size_t>(state.size());
  ASSERT_EQ(bytes->size(), 8 * head + 8 * n);
  std::vector<double> numbers(head);
  std::memcpy(numbers.data(), bytes->data(), 8 * head);
  EXPECT_EQ(numbers[1], static_cast<double>(n));
  EXPECT_EQ(numbers[4], scene.time_at(5000));
  const Pose pose = pose_at(scene.containers[0], scene.time_at(5000));
  ASSERT_GT(pose.rotation(0, 2), 0.01) << "the cup is tilted there";
  for (int k = 0; k < 9; ++k) EXPECT_EQ(numbers[14 + static_cast<std::size_t>(k)], pose.rotation(k / 3, k % 3));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(numbers[23 + static_cast<std::size_t>(k)], pose.translation[k]);
  std::vector<std::uint16_t> values(4 * n);
  std::memcpy(values.data(), bytes->data() + 8 * head, 8 * n);
  const Vec3 extent = scene.domain.max - scene.domain.min;
  for (std::size_t i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR(scene.domain.min[a] + extent[a] * values[4 * i + static_cast<std::size_t>(a)] / 65535.0,
                  state.position(a, static_cast<Eigen::Index>(i)), 0.51 * extent[a] / 65535);
  EXPECT_NEAR(values[4 * 3 + 3], 32768, 1);
  EXPECT_EQ(values[4 * 4 + 3], 65535) << "beyond the scale: its end";
  EXPECT_EQ(values[4 * 5 + 3], 0) << "no number";
}

TEST(LiveScores, AreThoseOfTheTolerances) {
  const Scene scene = cups().running();
  const Walls walls = sample_walls(scene);
  const ParticleState state = initial_state(scene);
  const WallSolution volumes = wall_solution(scene, walls);
  const ReferenceSolution oracle = reference_solution(scene, walls, volumes, state);
  Fields fields = oracle.fields;
  fields.density[17] += 3 * oracle.tolerance.density[17];
  fields.acceleration(1, 40) = std::nan("");
  const Scores scores = scores_of(scene, walls, volumes, state, fields);
  EXPECT_NEAR(scores.values[17], 3, 1e-6);
  EXPECT_TRUE(std::isinf(scores.values[40]));
  EXPECT_EQ(scores.particle, 40);
  EXPECT_EQ(scores.field, "acceleration");
  EXPECT_EQ(scores.values[18], 0);
}

// --- a scene that is changed -------------------------------------------------------------------------------------

TEST(LiveScene, GoesOnWithOtherForcesAndRestartsWithOtherParticles) {
  LiveScene scene = cups();
  std::int64_t substep = 700;
  EXPECT_EQ(scene.set("/gravity", {0, 0, -3.0}, substep), LiveScene::Outcome::goes_on);
  EXPECT_EQ(scene.running().gravity, Vec3(0, 0, -3));
  EXPECT_EQ(substep, 700);
  EXPECT_EQ(scene.set("/particle_spacing", 0.0055, substep), LiveScene::Outcome::restarts);
  EXPECT_EQ(scene.running().particle_spacing, 0.0055);
  EXPECT_EQ(scene.running().gravity, Vec3(0, 0, -3));
  EXPECT_EQ(scene.set("/fill/0/level", 0.03, substep), LiveScene::Outcome::restarts);
}

TEST(LiveScene, RefusesByTheScenesOwnRulesAndStaysAsItWas) {
  LiveScene scene = cups();
  std::int64_t substep = 700;
  const std::string before = scene.text();
  const auto refused = [&](const char* pointer, const ordered_json& value, const char* told) {
    try {
      scene.set(pointer, value, substep);
      ADD_FAILURE() << pointer << " is taken";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(told), std::string::npos) << error.what();
    }
    EXPECT_EQ(scene.text(), before);
  };
  refused("/fluid/viscosity", -1, "fluid.viscosity = -1");
  refused("/fluid/viscosity", "thick", "fluid.viscosity");
  refused("/fluid/color", 1, "color");
  refused("/gravity", {0, 0}, "gravity");
  refused("/gravity/x", 1, "gravity");
  refused("gravity", 1, "no such place");
  refused("/particle_spacing", 0.009, "wall_thickness");
  EXPECT_THROW(scene.replace("{"), InputError);
  EXPECT_THROW(scene.set_particles(0), InputError);
  EXPECT_EQ(scene.text(), before);
  EXPECT_EQ(substep, 700);
}

TEST(LiveScene, LooksForDistancesOfContainersAgainOnlyWhereTheyMayHaveChanged) {
  LiveScene scene = cups();
  std::int64_t substep = 0;
  // The cups stand apart by more than H as it is, and not where the source is lowered.
  EXPECT_THROW(scene.set("/containers/0/origin", {-0.03, 0, 0.03}, substep), InputError);
  EXPECT_EQ(scene.set("/gravity", {0, 0, -5.0}, substep), LiveScene::Outcome::goes_on);
  EXPECT_EQ(scene.set("/containers/0/origin", {-0.066, 0, 0.092}, substep), LiveScene::Outcome::restarts);
}

TEST(LiveScene, ShortensTheSubstepByAWholeNumberAtTheSameTime) {
  LiveScene scene = cups();
  std::int64_t substep = 701;
  const double time = scene.running().time_at(substep), step = scene.running().time_step();
  ASSERT_EQ(scene.set("/fluid/viscosity", 30.0, substep), LiveScene::Outcome::goes_on);
  EXPECT_EQ(substep % 701, 0);
  EXPECT_GT(substep, 701);
  EXPECT_NEAR(scene.running().time_at(substep), time, 1e-12);
  EXPECT_LT(scene.running().time_step(), step);
  // Back to a thin fluid: the short substep stays, so that time stays a whole number of them.
  const std::int64_t now = substep;
  scene.set("/fluid/viscosity", 0.05, substep);
  EXPECT_EQ(substep, now);
  scene.restart();
  EXPECT_EQ(scene.running().time_step(), step);
}

TEST(LiveScene, AHandTurnsACupFromWhereItIs) {
  LiveScene scene = cups();
  const std::int64_t start = 4000;
  const double before = angle_of(scene, start);
  ASSERT_GT(before, 0.5 * degree) << "the schedule has tilted it";
  scene.tilt("source", 60, start);
  EXPECT_NEAR(angle_of(scene, start), before, 1e-12);
  std::int64_t now = start;
  int looks = 0;
  while (!scene.arrive(now) && ++looks < 100) {
    const double angle = angle_of(scene, now);
    now += scene.until_arrival(now, 500);
    EXPECT_GT(angle_of(scene, now), angle);
  }
  EXPECT_NEAR(angle_of(scene, now), 60 * degree,
              scene.hand_rate(scene.running().containers[0]) * scene.running().time_step());
  const double took = scene.running().time_at(now) - scene.running().time_at(start);
  EXPECT_NEAR(took, (60 * degree - before) / scene.hand_rate(scene.running().containers[0]), 1e-3);
  EXPECT_EQ(angle_of(scene, now + 3000), angle_of(scene, now)) << "and stays there";
}

TEST(LiveScene, AHandThatTurnsSlowerThanItDidArrivesAllTheSame) {
  LiveScene scene = cups();
  scene.tilt("source", 60, 0);
  std::int64_t now = 1000;
  scene.set("/gravity", {0, 0, -0.01}, now);  // a slow fluid, a slow hand
  scene.set("/gravity", {0, 0, -9.81}, now);
  int rounds = 0;
  while (!scene.arrive(now) && ++rounds < 1000) now += scene.until_arrival(now, 500);
  EXPECT_NEAR(angle_of(scene, now + 5000), 60 * degree, 1e-3);
}

TEST(LiveScene, AHandGivesACupBackToItsSchedule) {
  LiveScene scene = cups();
  scene.tilt("source", 30, 0);
  std::int64_t now = 0;
  while (!scene.arrive(now)) now += scene.until_arrival(now, 500);
  scene.follow_schedule("source", now);
  double angle = angle_of(scene, now);
  const double most = scene.hand_rate(scene.running().containers[0]) * scene.running().time_step();
  while (scene.by_hand("source")) {
    const std::int64_t n = scene.until_arrival(now, 500);
    now += n;
    ASSERT_LT(now, 20'000);
    scene.arrive(now);
    EXPECT_LE(std::abs(angle_of(scene, now) - angle), most * static_cast<double>(n + 1)) << "no jump";
    angle = angle_of(scene, now);
  }
  const Scene scheduled = cups().running();
  for (const std::int64_t later : {now, now + 100, now + 5000})
    EXPECT_EQ(angle_of(scene, later), tilt_at(*scheduled.containers[0].tilt, scheduled.time_at(later)).angle);
}

TEST(LiveScene, RefusesHandsWhereNothingTilts) {
  LiveScene scene = cups();
  EXPECT_THROW(scene.tilt("receiver", 10, 0), InputError);
  EXPECT_THROW(scene.tilt("teapot", 10, 0), InputError);
  EXPECT_THROW(scene.tilt("source", 721, 0), InputError);
  EXPECT_THROW(scene.tilt("source", std::nan(""), 0), InputError);
  EXPECT_THROW(scene.follow_schedule("receiver", 0), InputError);
}

}  // namespace
}  // namespace decant::live
