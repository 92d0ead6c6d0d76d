/// \file
/// The command under mpirun: backends run on its processes, a pour has the same bits on any number of them, ends
/// soon when one dies, and goes on with another number.
#include "gpu/backends.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tests/built_files.hpp"
#include "tests/file_bytes.hpp"
#include "tests/shell_output.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <sstream>
#include <string>
#include <thread>

#include <signal.h>
#include <stdlib.h>

namespace decant {
namespace {

using test::shell_output;
using test::ShellOutput;

const std::string command = test::command(), program = test::command_file();

ShellOutput on_ranks(int ranks, const std::string& arguments) {
  // Containers are root; machines of few cores are asked for more ranks than that.
  return shell_output(
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe --bind-to none -n " +
      std::to_string(ranks) + " " + command + " " + arguments);
}

class Mpirun : public testing::Test {
 protected:
  void SetUp() override {
    if (mpi_version() == "none") GTEST_SKIP() << "built without MPI";
    if (shell_output("command -v mpirun").status != 0) GTEST_SKIP() << "no mpirun";
    // What started this program is not what the processes are to think of.
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_SIZE"}) ::unsetenv(name);
  }

  /// tests/live/cups.json, cut short.
  std::string scene_file() const {
    std::string text = test::bytes_of(DECANT_SOURCE_DIR "/tests/live/cups.json");
    const std::string end = "\"end\": 2, \"frames\": 100";
    text.replace(text.find(end), end.size(), "\"end\": 1, \"frames\": 20");
    const std::string path = folder_ / "cups.json";
    std::ofstream(path) << text;
    return path;
  }
  std::string out(const std::string& name) const { return folder_ / name; }
  std::string pour(const std::string& name) const {
    return "pour " + scene_file() + " --backend hash --executor host --quiet --out " + out(name);
  }
  void expect_same_pours(const std::string& a, const std::string& b) const {
    const ShellOutput diff = shell_output(command + " diff " + out(a) + " " + out(b));
    std::istringstream lines(diff.text);
    std::string line;
    std::getline(lines, line);
    EXPECT_NE(line.find("rms (dx)"), std::string::npos) << diff.text;
    int frames = 0;
    while (std::getline(lines, line)) {
      std::istringstream row(line);
      double frame = 0, time = 0, difference = 0;
      if (!(row >> frame >> time)) break;
      ++frames;
      while (row >> difference) EXPECT_EQ(difference, 0) << line;
    }
    EXPECT_GT(frames, 5) << diff.text;
  }

  const TemporaryFolder folder_;
};

TEST_F(Mpirun, BackendsConformOnItsProcesses) {
  const std::string recordings =
      DECANT_SOURCE_DIR "/fixtures/hostile-periodic-box.h5 " DECANT_SOURCE_DIR "/fixtures/hostile-crowd.h5 ";
  for (const int ranks : {2, 4}) {
    const ShellOutput o = on_ranks(ranks, "conform " + recordings + "--backend hash,list --executor host");
    EXPECT_EQ(o.status, 0) << o.text;
    const std::string name = "list(ranks=" + std::to_string(ranks) + ") host";
    EXPECT_NE(o.text.find(name), std::string::npos) << o.text;
    EXPECT_NE(o.text.find("2 fixtures × 2 backends: pass"), std::string::npos) << o.text;
  }
}

TEST_F(Mpirun, APourHasTheSameBits) {
  EXPECT_EQ(shell_output(command + " " + pour("one")).status, 0);
  for (const int ranks : {2, 4}) {
    const std::string name = "ranks-" + std::to_string(ranks);
    const ShellOutput o = on_ranks(ranks, pour(name));
    EXPECT_EQ(o.status, 0) << o.text;
    expect_same_pours("one", name);
  }
}

/// Process of a rank of the mpirun whose command line has this folder in it; 0: not there yet.
int process_of_rank(const std::string& name, int rank) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string path = entry.path();
    std::ifstream line(path + "/cmdline"), environment(path + "/environ");
    std::stringstream whole, variables;
    whole << line.rdbuf();
    variables << environment.rdbuf();
    if (whole.str().starts_with(program) && whole.str().find(name) != std::string::npos &&
        variables.str().find("OMPI_COMM_WORLD_RANK=" + std::to_string(rank) + '\0') != std::string::npos)
      return std::stoi(entry.path().filename());
  }
  return 0;
}

TEST_F(Mpirun, ADeadRankEndsThePourWhichGoesOnWithAnotherNumber) {
  EXPECT_EQ(shell_output(command + " " + pour("whole")).status, 0);
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  auto run = std::async(std::launch::async, [&] { return on_ranks(3, pour("cut")); });
  // A few frames later.
  while (!std::filesystem::exists(out("cut") + "/checkpoint.h5") && seconds() < 60)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  const int victim = process_of_rank(out("cut"), 2);
  ASSERT_GT(victim, 0);
  ASSERT_EQ(::kill(victim, SIGKILL), 0);
  const double killed = seconds();
  const ShellOutput cut = run.get();
  EXPECT_LT(seconds() - killed, 30);
  EXPECT_NE(cut.status, 0);
  EXPECT_NE(cut.text.find("signal 9"), std::string::npos) << cut.text;
  ASSERT_TRUE(std::filesystem::exists(out("cut") + "/checkpoint.h5")) << cut.text;
  const ShellOutput resumed = on_ranks(2, pour("cut") + " --resume");
  EXPECT_EQ(resumed.status, 0) << resumed.text;
  expect_same_pours("whole", "cut");
}

TEST_F(Mpirun, WhatIsWrongIsSaidOnceAndWithItsExitStatus) {
  const ShellOutput absent = on_ranks(3, "pour " + out("nowhere.json") + " --out " + out("x"));
  EXPECT_EQ(absent.status, 2);
  const auto first = absent.text.find("decant: ");
  EXPECT_NE(first, std::string::npos) << absent.text;
  EXPECT_EQ(absent.text.find("decant: ", first + 1), std::string::npos) << absent.text;
  const ShellOutput twice = on_ranks(2, "conform --backend hash:ranks=2 --executor host");
  EXPECT_EQ(twice.status, 2);
  EXPECT_NE(twice.text.find("whose processes are the ranks"), std::string::npos) << twice.text;
  // What ranks cannot run, rank 0 runs.
  const ShellOutput brute =
      on_ranks(2, "conform " DECANT_SOURCE_DIR "/fixtures/hostile-one-particle.h5 --backend brute --executor host");
  EXPECT_EQ(brute.status, 0) << brute.text;
}

}  // namespace
}  // namespace decant
