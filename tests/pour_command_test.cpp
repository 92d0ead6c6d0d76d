/// \file
/// A pour that is stopped, killed or failed, and what it leaves behind.
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tools/pour/pour.hpp"

#include "oracle/files/hdf5_io.hpp"
#include "oracle/solution/fixture.hpp"
#include "oracle/solution/reference_backend.hpp"
#include "reference/error.hpp"
#include "tests/falling_points.hpp"
#include "tests/file_bytes.hpp"
#include "tests/pour_arguments.hpp"
#include "tools/commands/commands.hpp"
#include "tools/frames/frame_file.hpp"
#include "tools/pour/checkpoint.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace decant {
namespace {

namespace fs = std::filesystem;
using test::FallingPoints;
using test::pour_command;

pour::Options quiet_options(const fs::path& out) {
  pour::Options options;
  options.out = out;
  options.quiet = true;
  return options;
}

using test::bytes_of;

/// Compares files without printing them.
::testing::AssertionResult same_bytes(const fs::path& a, const fs::path& b) {
  const std::string one = bytes_of(a), other = bytes_of(b);
  const auto at = std::mismatch(one.begin(), one.end(), other.begin(), other.end());
  if (at.first == one.end() && at.second == other.end()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << a << " and " << b << " differ from byte " << at.first - one.begin() << " on";
}

/// Columns that say how the fluid moved, and not how long that took.
void expect_same_timeline(const fs::path& a, const fs::path& b) {
  const Hdf5Reader one(a), other(b);
  for (const char* column :
       {"/time", "/kinetic_energy", "/max_density", "/deepest", "/mass/source", "/mass/in_flight", "/mass/receiver"})
    EXPECT_EQ(one.vector(column), other.vector(column)) << column;
  for (const char* column : {"/substep", "/inside", "/crossed", "/particles/receiver"})
    EXPECT_EQ(one.integers(column), other.integers(column)) << column;
}

/// Pours in a child that is gone, without a word, when `backend` reaches the substep.
void pour_until_killed(const Scene& scene, Backend& backend, const pour::Options& options) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    try {
      pour::run(scene, backend, options);
    } catch (...) {
    }
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
}

TEST(Pour, LeavesWholeFilesAndNoTraceOfTheWork) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints backend;
  const pour::Result result = pour::run(scene, backend, quiet_options(folder / "out"));
  EXPECT_TRUE(result.finished);
  EXPECT_EQ(result.summary.substeps, 60);
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder / "out")) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"frames.h5", "frames.vtkhdf", "frames.xdmf", "timeline.h5", "walls.vtkhdf",
                                             "walls.xdmf"}));
}

TEST(Pour, AccountsForAllMassAtEveryFrame) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints backend;
  const pour::Result result = pour::run(scene, backend, quiet_options(folder / "out"));
  EXPECT_TRUE(result.summary.balanced());
  double mass = 0;
  for (const double m : result.summary.mass_at) mass += m;
  EXPECT_NEAR(mass, 6 * 6 * 5 * scene.particle_mass(), 1e-12);
  EXPECT_EQ(result.timeline.rows.size(), 13u);
}

/// The first particle leaps in an arch, out of the fixed cup over its rim, or straight through its wall.
class Leaping : public FallingPoints {
 public:
  explicit Leaping(double height) : height_(height) {}
  void load(const Scene& scene, const Walls& walls, const ParticleState& state) override {
    FallingPoints::load(scene, walls, state);
    state_.position.col(0) = Vec3(0, 0, 0.05);
  }
  Status advance(int substeps) override {
    state_.substep += substeps;
    const double s = scene_.time_at(state_.substep) / scene_.schedule.end;
    state_.position.col(0) = Vec3(0.3 * s, 0, 0.05 + 4 * height_ * s * (1 - s));
    return {};
  }

 private:
  double height_;
};

TEST(Pour, FollowsPathsOverARimHoweverFewFramesThereAre) {
  for (const int frames : {1, 2, 30}) {
    const TemporaryFolder folder;
    Scene scene = test::falling_points_scene(frames);
    scene.schedule.substeps_per_frame = 300 / frames;
    Leaping over(0.3), through(0);
    EXPECT_FALSE(pour::run(scene, over, quiet_options(folder / "over")).summary.penetrated()) << frames;
    EXPECT_TRUE(pour::run(scene, through, quiet_options(folder / "through")).summary.penetrated()) << frames;
  }
}

TEST(Pour, StoppedAndResumedEndsInTheSameBits) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints whole, first, second;
  pour::run(scene, whole, quiet_options(folder / "whole"));

  pour::Options options = quiet_options(folder / "parts");
  int frames = 0;
  options.stop = [&] { return frames++ == 5; };
  const pour::Result stopped = pour::run(scene, first, options);
  EXPECT_FALSE(stopped.finished);
  EXPECT_EQ(stopped.frame, 5);
  EXPECT_FALSE(fs::exists(folder / "parts/frames.h5"));
  options.resume = true;
  options.stop = {};
  const pour::Result resumed = pour::run(scene, second, options);
  EXPECT_TRUE(resumed.finished);
  EXPECT_TRUE(same_bytes(folder / "whole/frames.h5", folder / "parts/frames.h5"));
  for (const char* file : {"frames.xdmf", "walls.xdmf", "frames.vtkhdf", "walls.vtkhdf"})
    EXPECT_TRUE(same_bytes(folder / "whole" / file, folder / "parts" / file)) << file;
  expect_same_timeline(folder / "whole/timeline.h5", folder / "parts/timeline.h5");
  EXPECT_EQ(resumed.timeline.stages.integrate.calls, 60);
}

TEST(Pour, KilledAnywhereLeavesReadableFramesAndResumesToTheSameBits) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  // Beside the threads of "host" no frame is written.
  FallingPoints whole;
  whole.info_.executor = "cuda";
  pour::run(scene, whole, quiet_options(folder / "whole"));
  for (const std::int64_t deadly : {0, 15, 40, 55}) {
    const fs::path out = folder / ("out" + std::to_string(deadly));
    FallingPoints dying, second;
    dying.info_ = second.info_ = whole.info_;
    dying.before_advance = [&](std::int64_t substep) {
      if (substep == deadly) ::raise(SIGKILL);
    };
    pour::Options options = quiet_options(out);
    options.checkpoint_seconds = deadly == 40 ? 0.0 : 30.0;
    pour_until_killed(scene, dying, options);

    EXPECT_FALSE(fs::exists(out / "frames.h5"));
    // What ended before the frame under way is there, but for one frame that may have been on its way to the disk.
    const Eigen::VectorXd times = Hdf5Reader(out / "frames.h5.partial").vector("/time", 13);
    for (std::int64_t frame = 0; frame < std::max<std::int64_t>(deadly / 5, 1); ++frame)
      EXPECT_EQ(times[frame], scene.time_at(5 * frame)) << "killed at substep " << deadly;
    const pour::Checkpoint checkpoint = pour::read_checkpoint(out / "checkpoint.h5");
    EXPECT_EQ(checkpoint.frame, deadly == 40 ? 8 : 0);
    options.resume = true;
    EXPECT_TRUE(pour::run(scene, second, options).finished);
    EXPECT_TRUE(same_bytes(out / "frames.h5", folder / "whole/frames.h5"));
  }
}

TEST(Pour, KilledWhileNamingItsFilesResumesAllTheSame) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints whole, second;
  pour::Options options = quiet_options(folder / "out");
  int frames = 0;
  options.stop = [&] { return frames++ == 5; };
  pour::run(scene, whole, options);
  fs::rename(folder / "out/frames.h5.partial", folder / "out/frames.h5");
  options.resume = true;
  options.stop = {};
  EXPECT_TRUE(pour::run(scene, second, options).finished);
}

TEST(Pour, WithTheReferenceResumesToTheSameBits) {
  const TemporaryFolder folder;
  Scene scene = test::falling_points_scene(4);
  scene.schedule.end = 0.008;  // 20 substeps of 0.4 ms, as the speed of sound asks for
  pour::Options options = quiet_options(folder / "whole");
  pour::run(scene, *make_reference_backend(), options);
  options.out = folder / "parts";
  int frames = 0;
  options.stop = [&] { return frames++ == 2; };
  pour::run(scene, *make_reference_backend(), options);
  options.resume = true;
  options.stop = {};
  EXPECT_TRUE(pour::run(scene, *make_reference_backend(), options).finished);
  EXPECT_TRUE(same_bytes(folder / "whole/frames.h5", folder / "parts/frames.h5"));
  expect_same_timeline(folder / "whole/timeline.h5", folder / "parts/timeline.h5");
}

/// The InputError of an attempt that must be refused.
template <class Attempt>
InputError refusal(Attempt attempt) {
  try {
    attempt();
  } catch (const InputError& error) {
    return error;
  }
  ADD_FAILURE() << "must be refused";
  return {"", "", "", ""};
}

TEST(Pour, NamesWhatDiffersFromThePourToResume) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints backend;
  pour::Options options = quiet_options(folder / "out");
  options.stop = [] { return true; };
  pour::run(scene, backend, options);
  options.resume = true;

  Scene thicker = scene;
  thicker.fluid.viscosity = 0.06;
  const InputError scene_differs = refusal([&] { pour::run(thicker, backend, options); });
  EXPECT_NE(scene_differs.key().find("viscosity"), std::string::npos) << scene_differs.what();
  EXPECT_EQ(scene_differs.value(), "0.06");

  const InputError frames_differ = refusal([&] { pour::run(pour::with_frames(scene, 6), backend, options); });
  EXPECT_EQ(frames_differ.key(), "time.frames");

  FallingPoints other;
  other.info_.name = "hash";
  EXPECT_EQ(refusal([&] { pour::run(scene, other, options); }).key(), "--backend");
  other = backend;
  other.info_.executor = "cuda";
  EXPECT_EQ(refusal([&] { pour::run(scene, other, options); }).key(), "--executor");
  options.csv = true;
  EXPECT_EQ(refusal([&] { pour::run(scene, backend, options); }).key(), "--csv");
}

TEST(Pour, DoesNotOverwriteAndDoesNotResumeWhatIsComplete) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(2);
  FallingPoints backend;
  pour::Options options = quiet_options(folder / "out");
  pour::run(scene, backend, options);
  EXPECT_EQ(refusal([&] { pour::run(scene, backend, options); }).key(), "--out");
  options.resume = true;
  EXPECT_EQ(refusal([&] { pour::run(scene, backend, options); }).key(), "--resume");
  options.out = folder / "nothing-here";
  EXPECT_EQ(refusal([&] { pour::run(scene, backend, options); }).key(), "--resume");
}

TEST(Pour, IsRefusedBeforeAnyWorkWhereTheDiskIsTooSmall) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(1'000'000'000);
  FallingPoints backend;
  const InputError error = refusal([&] { pour::run(scene, backend, quiet_options(folder / "out")); });
  EXPECT_EQ(error.key(), "--out");
  EXPECT_NE(error.bound().find("needs"), std::string::npos);
  EXPECT_NE(error.bound().find("free"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(Pour, SaysBeforeTheFirstFrameHowMuchItWrites) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints backend;
  pour::Options options = quiet_options(folder / "out");
  options.quiet = false;
  testing::internal::CaptureStderr();
  const pour::Result result = pour::run(scene, backend, options);
  const std::string said = testing::internal::GetCapturedStderr();
  const std::string per_frame =
      fmt::format("{:.1f} kB", 1e-3 * double(frames::file_bytes(frames::layout_of(scene, 180))) / 13);
  EXPECT_EQ(said.find("disk: 13 frames of " + per_frame + ", needs "), 0u) << said;
  EXPECT_LT(said.find(" free\n"), said.find("frame 0/12")) << said;
  EXPECT_GE(result.fields_seconds, 0);
  EXPECT_GE(result.wait_seconds, 0);
}

TEST(Pour, SavesTheLastGoodStateWhereTheBackendReportsTrouble) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints backend;
  backend.trouble_at = 17;
  try {
    pour::run(scene, backend, quiet_options(folder / "out"));
    FAIL() << "must fail";
  } catch (const BackendError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("particle 3, substep 17"), std::string::npos) << what;
    EXPECT_NE(what.find("failed-state.h5"), std::string::npos) << what;
  }
  const Fixture dumped = read_fixture(folder / "out/failed-state.h5");
  EXPECT_EQ(dumped.state.substep, 15);
  EXPECT_EQ(dumped.state.size(), 6 * 6 * 5);
}

/// Falls as the others do, but tells of a value that is none.
class Poisoned : public FallingPoints {
 public:
  Poisoned(std::int64_t substep, bool density) : substep_(substep), density_(density) {}
  Status evaluate(Fields& out, const StageInputs* given) override {
    const Status status = FallingPoints::evaluate(out, given);
    if (density_ && state_.substep == substep_) out.density[7] = NAN;
    return status;
  }
  void read(ParticleState& out) const override {
    FallingPoints::read(out);
    if (!density_ && state_.substep == substep_) out.velocity(1, 7) = INFINITY;
  }

 private:
  std::int64_t substep_;
  bool density_;
};

TEST(Pour, SavesTheLastGoodStateWhereAValueIsNotFinite) {
  for (const bool density : {false, true}) {
    const TemporaryFolder folder;
    const Scene scene = test::falling_points_scene();
    Poisoned backend(20, density);
    try {
      pour::run(scene, backend, quiet_options(folder / "out"));
      FAIL() << "must fail";
    } catch (const BackendError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find(density ? "particle 7, substep 20" : "substep 20"), std::string::npos) << what;
    }
    EXPECT_EQ(read_fixture(folder / "out/failed-state.h5").state.substep, density ? 20 : 15);
    // Frames before it are in the file.
    EXPECT_EQ(Hdf5Reader(folder / "out/frames.h5.partial").vector("/time", 13)[3], scene.time_at(15));
  }
}

TEST(Pour, WritesCsvFramesBesideTheOthers) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  FallingPoints backend;
  pour::Options options = quiet_options(folder / "out");
  options.csv = true;
  pour::run(scene, backend, options);
  for (const char* name : {"fluid_000000.csv", "fluid_000003.csv", "boundary_000003.csv", "boundary_static.csv"})
    EXPECT_TRUE(fs::exists(folder / "out/csv" / name)) << name;
}

TEST(PourCommand, RefusesOptionsOutOfRangeNamingThemAndTheirBounds) {
  const TemporaryFolder folder;
  const std::string scene = std::string(DECANT_SOURCE_DIR) + "/fixtures/scenes/pour-4k.json";
  const std::vector<std::string> base = {scene, "--quiet", "--out", folder / "out"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = base;
    all.insert(all.end(), more.begin(), more.end());
    return refusal([&] { pour_command(all); });
  };
  EXPECT_EQ(with({"--frames", "0"}).key(), "--frames");
  EXPECT_EQ(with({"--particles", "-5"}).value(), "-5");
  EXPECT_EQ(with({"--backend", "hsah"}).key(), "--backend");
  EXPECT_EQ(with({"--executor", "gpu"}).key(), "--executor");
  EXPECT_EQ(with({"--backend", "reference", "--executor", "cuda"}).key(), "--executor");
  EXPECT_THROW(pour_command({scene}), CLI::ParseError);
  EXPECT_THROW(pour_command({scene, "--out", folder / "out", "--colour"}), CLI::ParseError);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(Summary, SeesMassThatDoesNotAddUpAndTheFirstPenetration) {
  pour::Timeline timeline;
  timeline.rows.resize(4);
  for (std::int64_t f = 0; f < 4; ++f) {
    pour::TimelineRow& row = timeline.rows[static_cast<std::size_t>(f)];
    row.frame = f;
    row.particles_at = {10, 0, 0, 0, 0};
    row.mass_at = {10 * 0.25, 0, 0, 0, 0};
    row.kinetic_energy = f == 1 ? 3.0 : 1.0;
  }
  EXPECT_TRUE(pour::summarise(timeline, 10, 0.25).balanced());
  EXPECT_FALSE(pour::summarise(timeline, 10, 0.25).penetrated());
  timeline.rows[3].particles_at[0] = 9;
  timeline.rows[2].mass_at[0] = 10 * 0.25 * (1 + 1e-12);
  timeline.rows[2].crossed = 1;
  timeline.rows[2].first_crossed = 7;
  timeline.rows[3].inside = 2;
  const pour::Summary summary = pour::summarise(timeline, 10, 0.25);
  EXPECT_EQ(summary.unbalanced_frames, 2);
  EXPECT_EQ(summary.penetration_frame, 2);
  EXPECT_EQ(summary.penetration_particle, 7);
  EXPECT_EQ(summary.peak_kinetic_energy, 3.0);
}

TEST(WithFrames, KeepsTheTimeAndNeverLengthensASubstepThatTheSceneSets) {
  Scene scene = test::falling_points_scene(12);  // 60 substeps
  scene.schedule.substeps_derived = false;
  for (const int frames : {1, 5, 7, 12, 59, 60, 61, 1000}) {
    const Scene other = pour::with_frames(scene, frames);
    EXPECT_EQ(other.schedule.frames, frames);
    EXPECT_EQ(other.schedule.end, scene.schedule.end);
    EXPECT_LE(other.time_step(), scene.time_step() * (1 + 1e-15));
  }
}

}  // namespace
}  // namespace decant
