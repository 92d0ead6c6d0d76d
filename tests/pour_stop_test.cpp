/// \file
/// Pours in processes of their own: two that want the same folder, and such that are told to stop.
#include "tools/pour/pour.hpp"

#include "gpu/backends.hpp"
#include "oracle/files/file_aside.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "reference/error.hpp"
#include "reference/scene_file.hpp"
#include "tests/falling_points.hpp"
#include "tests/file_bytes.hpp"
#include "tests/pour_arguments.hpp"
#include "tools/commands/commands.hpp"
#include "tools/common/stop_signal.hpp"
#include "tools/pour/checkpoint.hpp"
#include "tools/pour/folder_lock.hpp"
#include "tools/pour/segments.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>
#include <thread>

namespace decant {
namespace {

namespace fs = std::filesystem;
using test::FallingPoints;
using test::pour_command;

using test::bytes_of;

/// A child that ends with what `work` returns, or 2 and 3 as the command does.
class Process {
 public:
  explicit Process(const std::function<int()>& work) : id_(::fork()) {
    if (id_ != 0) return;
    int status = exit_failure;
    try {
      status = work();
    } catch (const InputError& error) {
      std::fprintf(stderr, "%s\n", error.what());
      status = exit_bad_input;
    } catch (...) {
    }
    ::_exit(status);
  }
  void signal(int number) const { ::kill(id_, number); }
  /// Exit status, or −n after signal n.
  int wait() const {
    int status = 0;
    EXPECT_EQ(::waitpid(id_, &status, 0), id_);
    return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  }

 private:
  pid_t id_;
};

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void wait_for(const fs::path& file) {
  for (int k = 0; k < 1000 && !fs::exists(file); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_TRUE(fs::exists(file));
}

/// Two scenes of different sizes, so that what one writes into the other's file shows.
Scene small_scene(int frames) {
  Scene scene = test::falling_points_scene(frames);
  scene.fluid.sound_speed = 20;
  scene.schedule.end = 0.002 * frames;
  scene.schedule.substeps_derived = false;
  scene.schedule.substeps_per_frame = 15;
  return scene;
}
Scene wide_scene(int frames) {
  Scene scene = small_scene(frames);
  scene.name = "wide";
  scene.fills[0].box->min.x() = -0.05;
  return scene;
}

TEST(TwoPours, IntoOneFolderLeaveTheFilesOfTheOneThatWasFirst) {
  const TemporaryFolder folder;
  const std::string one = folder / "one.json", other = folder / "other.json";
  write_text_file(one, scene_to_json(small_scene(6)));
  write_text_file(other, scene_to_json(wide_scene(6)));
  const auto pour_into = [&](const std::string& scene, const std::string& name) {
    return pour_command({scene, "--out", folder / name, "--quiet", "--csv"});
  };
  ASSERT_EQ(Process([&] { return pour_into(one, "one"); }).wait(), 0);
  ASSERT_EQ(Process([&] { return pour_into(other, "other"); }).wait(), 0);
  for (int attempt = 0; attempt < 6; ++attempt) {
    const std::string out = "both" + std::to_string(attempt);
    const bool swapped = attempt % 2 == 1;
    const Process first([&] { return pour_into(swapped ? other : one, out); });
    const Process second([&] { return pour_into(swapped ? one : other, out); });
    const int first_status = first.wait(), second_status = second.wait();
    ASSERT_EQ(std::minmax(first_status, second_status), std::minmax(0, int{exit_bad_input}));
    const bool is_one = (first_status == 0) != swapped;
    for (const char* file : {"frames.h5", "frames.xdmf", "csv/fluid_000003.csv"})
      EXPECT_TRUE(bytes_of(folder / out / file) == bytes_of(folder / (is_one ? "one" : "other") / file)) << file;
    EXPECT_FALSE(fs::exists(folder / out / "csv/fluid_000007.csv"));
  }
}

TEST(TwoPours, OfWhichOneRunsLeaveItsFileAlone) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  pour::Options options;
  options.out = folder / "out";
  options.quiet = true;
  // Every frame ends with a checkpoint, which waits for the thread that writes: nobody but the second pour
  // can change the file while it is looked at.
  options.checkpoint_seconds = 0;
  FallingPoints running;
  // While the first is at its 20th substep the second is refused, and leaves every byte.
  int refused = 0;
  running.before_advance = [&](std::int64_t substep) {
    if (substep != 20) return;
    const std::string frames = bytes_of(options.out / "frames.h5.partial");
    for (const bool resume : {false, true}) {
      const int status = Process([&] {
                           FallingPoints second;
                           pour::Options its = options;
                           its.resume = resume;
                           return pour::run(scene, second, its).finished ? 0 : 1;
                         }).wait();
      refused += status == exit_bad_input;
    }
    EXPECT_TRUE(frames == bytes_of(options.out / "frames.h5.partial"));
  };
  EXPECT_TRUE(pour::run(scene, running, options).finished);
  EXPECT_EQ(refused, 2);
}

TEST(FolderLock, IsLetGoByAProcessThatIsKilled) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "out");
  const Process holder([&] {
    const pour::FolderLock lock("--out", folder / "out");
    write_text_file(folder / "held", "yes");
    std::this_thread::sleep_for(std::chrono::seconds(60));
    return 0;
  });
  wait_for(folder / "held");
  EXPECT_THROW(pour::FolderLock("--out", folder / "out"), InputError);
  holder.signal(SIGKILL);
  EXPECT_EQ(holder.wait(), -SIGKILL);
  EXPECT_NO_THROW(pour::FolderLock("--out", folder / "out"));
  EXPECT_TRUE(fs::is_empty(folder / "out"));
}

TEST(FileAside, OfTwoThatWriteAtOnceOneIsThereWhole) {
  const TemporaryFolder folder;
  const fs::path file = folder / "text";
  const auto write = [&](char letter) {
    return Process([&, letter] {
      for (int k = 0; k < 200; ++k) write_text_file(file, std::string(100'000, letter));
      return 0;
    });
  };
  write_text_file(file, std::string(100'000, 'c'));
  const Process a = write('a'), b = write('b');
  for (int k = 0; k < 200; ++k) {
    const std::string text = bytes_of(file);
    ASSERT_TRUE(text == std::string(100'000, text.at(0)));
  }
  EXPECT_EQ(a.wait() + b.wait(), 0);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / ""), {}), 1);
}

/// A pour that its scene cannot interrupt: at the substep the backend works for a minute.
int stuck_pour(const Scene& scene, const fs::path& out, std::int64_t stuck_at) {
  const StopSignal signal;
  FallingPoints backend;
  backend.before_advance = [&](std::int64_t substep) {
    if (substep < stuck_at) return;
    write_text_file(out.string() + ".stuck", "");
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
    }
  };
  pour::Options options;
  options.out = out;
  options.quiet = true;
  options.stop = [] { return StopSignal::caught() != 0; };
  options.leave = [](const pour::Result&) { std::_Exit(128 + StopSignal::caught()); };
  return pour::run(scene, backend, options).finished ? 0 : 128 + StopSignal::caught();
}

TEST(StoppedPour, LeavesACallThatTakesLongAndLosesNothingBeforeIt) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints whole, second;
  pour::Options options;
  options.quiet = true;
  options.out = folder / "whole";
  pour::run(scene, whole, options);
  for (const int number : {SIGTERM, SIGINT}) {
    options.out = folder / std::to_string(number);
    const Process stuck([&] { return stuck_pour(scene, options.out, 35); });
    wait_for(options.out.string() + ".stuck");
    stuck.signal(number);
    EXPECT_LT(seconds_of([&] { EXPECT_EQ(stuck.wait(), 128 + number); }), 1.0);
    EXPECT_EQ(pour::read_checkpoint(options.out / "checkpoint.h5").frame, 35 / 5);
    options.resume = true;
    EXPECT_TRUE(pour::run(scene, second, options).finished);
    options.resume = false;
    EXPECT_TRUE(bytes_of(options.out / "frames.h5") == bytes_of(folder / "whole/frames.h5"));
  }
}

TEST(StoppedPour, EndsAtOnceWhenToldTwice) {
  for (const int second : {SIGTERM, SIGINT}) {
    const TemporaryFolder folder;
    const Process stuck([&] { return stuck_pour(test::falling_points_scene(), folder / "out", 35); });
    wait_for(folder / "out.stuck");
    stuck.signal(SIGINT);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stuck.signal(second);
    EXPECT_LT(seconds_of([&] { EXPECT_EQ(stuck.wait(), -second); }), 0.2);
  }
}

/// A frame of a million substeps, which no one waits for.
TEST(StoppedPour, StopsInsideAFrameAndGoesOnThereToTheSameBits) {
  const TemporaryFolder folder;
  const std::string file = folder / "scene.json";
  Scene scene = small_scene(1);
  scene.schedule.substeps_per_frame = 1'000'000;
  write_text_file(file, scene_to_json(scene));
  for (const char* backend : {"reference", "hash", "list"}) {
    const std::string out = folder / backend;
    const auto run = [&](bool resume) {
      std::vector<std::string> all = {
          file,    "--out",   out,          "--backend",
          backend, "--quiet", "--executor", std::string(backend) == "reference" ? "auto" : "host"};
      if (resume) all.push_back("--resume");
      return Process([all] { return pour_command(all); });
    };
    // How far it gets depends on what else the machine does; that it stops does not.
    std::int64_t before = 0;
    int ahead = 0;
    for (int attempt = 0; attempt < 7 && ahead < 2; ++attempt) {
      const Process pouring = run(attempt > 0);
      wait_for(out + "/checkpoint.h5");
      std::this_thread::sleep_for(std::chrono::milliseconds(500 << attempt));
      pouring.signal(SIGTERM);
      EXPECT_LT(seconds_of([&] { EXPECT_EQ(pouring.wait(), 128 + SIGTERM); }), 1.0) << backend;
      const pour::Checkpoint left = pour::read_checkpoint(out + "/checkpoint.h5");
      EXPECT_EQ(left.frame, 0);
      EXPECT_GE(left.state.substep, before) << backend;
      EXPECT_EQ(left.state.substep % pour::Segments::longest, 0);
      ahead += left.state.substep > before;
      before = left.state.substep;
    }
    EXPECT_EQ(ahead, 2) << backend;
  }
}

TEST(StoppedPour, InsideAFrameIsResumedToTheSameBitsAndTheSameTimeline) {
  const TemporaryFolder folder;
  Scene scene = small_scene(3);
  scene.schedule.substeps_per_frame = 260;  // three segments
  for (const char* name : {"hash", "list"}) {
    const auto backend = [&] { return make_backend(name, Executor::host); };
    pour::Options options;
    options.quiet = true;
    options.out = folder / name / "whole";
    ASSERT_TRUE(pour::run(scene, *backend(), options).finished);
    for (const int segments : {1, 2, 4, 8}) {
      options.out = folder / name / ("parts" + std::to_string(segments));
      options.resume = false;
      int asked = 0;
      options.stop = [&] { return asked++ == segments; };
      const pour::Result stopped = pour::run(scene, *backend(), options);
      EXPECT_FALSE(stopped.finished);
      EXPECT_EQ(stopped.substep, 260 * (segments / 3) + 260 * (segments % 3) / 3);
      options.stop = {};
      options.resume = true;
      EXPECT_TRUE(pour::run(scene, *backend(), options).finished);
      EXPECT_TRUE(bytes_of(options.out / "frames.h5") == bytes_of(folder / name / "whole/frames.h5"))
          << name << ", " << segments;
      const Hdf5Reader one(options.out / "timeline.h5"), other(folder / name / "whole/timeline.h5");
      for (const char* column : {"/max_speed", "/deepest", "/kinetic_energy", "/max_density"})
        EXPECT_EQ(one.vector(column), other.vector(column)) << column;
      for (const char* column : {"/crossed", "/fastest_particle", "/densest_particle"})
        EXPECT_EQ(one.integers(column), other.integers(column)) << column;
    }
  }
}

TEST(ResumedPour, IsThatOfTheSamePerturbation) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene();
  FallingPoints backend;
  pour::Options options;
  options.quiet = true;
  options.out = folder / "out";
  options.perturbation = 7;
  options.stop = [] { return true; };
  pour::run(scene, backend, options);
  options.stop = {};
  options.resume = true;
  for (const std::uint32_t other : {0u, 8u}) {
    options.perturbation = other;
    try {
      pour::run(scene, backend, options);
      FAIL() << "must be refused";
    } catch (const InputError& error) {
      EXPECT_EQ(error.key(), "--perturb");
      EXPECT_EQ(error.value(), std::to_string(other));
    }
  }
  options.perturbation = 7;
  EXPECT_TRUE(pour::run(scene, backend, options).finished);
}

TEST(Segments, CoverAFrameMeetWhereWallsAreLookedAtAndStayShort) {
  Scene scene = test::falling_points_scene(1);
  scene.schedule.substeps_derived = false;
  for (const int substeps : {1, 5, 99, 100, 101, 260, 7919, 1'000'000})
    for (const double speed : {0.1, 3.0, 30.0, 3000.0}) {
      scene.schedule.substeps_per_frame = substeps;
      scene.schedule.max_speed = speed;
      const pour::Segments segments(scene);
      std::int64_t done = 0, samples = 0;
      while (done < substeps) {
        ASSERT_TRUE(segments.meet_at(done));
        const std::int64_t end = segments.end_of(done);
        ASSERT_GT(end, done);
        ASSERT_LE(end - done, pour::Segments::longest);
        ASSERT_EQ(segments.meet_at(end - 1), end - 1 == done) << end << " of " << substeps;
        done = end;
        samples += segments.samples_at(done);
      }
      EXPECT_EQ(done, substeps);
      // 0.04 m of wall, crossed twice at most between two samples.
      const double needed = std::min(std::ceil(0.3 * speed / 0.08), double(substeps));
      EXPECT_EQ(static_cast<double>(samples), std::max(needed, 1.0)) << substeps << " " << speed;
    }
}

}  // namespace
}  // namespace decant
