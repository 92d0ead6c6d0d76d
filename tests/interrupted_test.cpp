/// \file
/// Long work that is told to stop keeps what it has done.
#include "oracle/files/report_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tools/commands/interruptible.hpp"

#include "oracle/files/file_aside.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/report/report.hpp"
#include "tests/file_bytes.hpp"
#include "tools/commands/commands.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>
#include <thread>

namespace decant {
namespace {

namespace fs = std::filesystem;

using test::bytes_of;

/// What becomes of `work`, in a child, that gets the signal as soon as it has said something on `heard`.
struct Interrupted {
  int status = -1;     // exit status, or −n after signal n
  double seconds = 0;  // from the signal to the end
  std::string out;
};

Interrupted interrupted(const TemporaryFolder& folder, int number, const std::function<int()>& work) {
  const fs::path out = folder / "stdout", err = folder / "stderr";
  const pid_t child = ::fork();
  if (child == 0) {
    if (!std::freopen(out.c_str(), "w", stdout) || !std::freopen(err.c_str(), "w", stderr)) ::_exit(99);
    std::setvbuf(stderr, nullptr, _IONBF, 0);
    int status = exit_failure;
    try {
      status = work();
    } catch (...) {
    }
    std::fflush(nullptr);
    ::_exit(status);
  }
  const auto said = [](const fs::path& file) { return fs::exists(file) && fs::file_size(file) > 0; };
  for (int k = 0; k < 3000 && !said(out) && !said(err); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ::kill(child, number);
  const auto start = std::chrono::steady_clock::now();
  Interrupted result;
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.status = WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  result.out = bytes_of(out);
  // What takes longer than the test is patient for must not have been waited for.
  EXPECT_LT(result.seconds, 5.0);
  return result;
}

int command(void (*add)(CLI::App&, int&), const std::vector<std::string>& arguments) {
  CLI::App app;
  int status = -1;
  add(app, status);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  app.parse(reversed);
  return status;
}

TEST(Interruptible, GivesUpThePartUnderWayAndHandsOverThoseBefore) {
  for (const int number : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    const std::string kept = folder / "kept";
    const Interrupted end = interrupted(folder, number, [&] {
      int done = 0;
      Interruptible work([&] { write_text_file(kept, interrupted_line(done, 9, "done")); });
      for (int part = 0; part < 9; ++part) {
        work.part([&] {
          if (part < 2) return;
          std::fprintf(stderr, "part %d\n", part);
          std::fflush(stderr);
          std::this_thread::sleep_for(std::chrono::seconds(60));
        });
        ++done;
      }
      return 0;
    });
    EXPECT_EQ(end.status, 128 + number);
    EXPECT_LT(end.seconds, 1.0);
    EXPECT_EQ(bytes_of(kept), "interrupted: 2 of 9 done");
  }
}

TEST(Interruptible, DoesNotBeginAnotherPart) {
  const TemporaryFolder folder;
  const std::string kept = folder / "kept";
  const Interrupted end = interrupted(folder, SIGINT, [&] {
    int done = 0;
    Interruptible work([&] { write_text_file(kept, interrupted_line(done, 1000, "done")); });
    for (int part = 0; part < 1000; ++part) {
      work.part([&] { std::this_thread::sleep_for(std::chrono::milliseconds(100)); });
      if (++done == 1) std::fprintf(stderr, "%d\n", done);
      std::fflush(stderr);
    }
    return 0;
  });
  EXPECT_EQ(end.status, 128 + SIGINT);
  EXPECT_LT(end.seconds, 1.0);
  EXPECT_NE(bytes_of(kept).find(" of 1000 done"), std::string::npos);
}

TEST(Interruptible, ThatIsNotInterruptedConcludesNothingByItself) {
  int concluded = 0, parts = 0;
  {
    Interruptible work([&] { ++concluded; });
    for (int part = 0; part < 3; ++part) work.part([&] { ++parts; });
    EXPECT_THROW(work.part([] { throw std::runtime_error("broken"); }), std::runtime_error);
  }
  EXPECT_EQ(parts, 3);
  EXPECT_EQ(concluded, 0);
}

const std::string fixtures = DECANT_SOURCE_DIR "/fixtures/";

TEST(InterruptedCommand, ConformKeepsTableReportAndJUnit) {
  const TemporaryFolder folder;
  const std::string report = folder / "report.h5", junit = folder / "junit.xml";
  // The second recording takes the oracle far longer than the test waits.
  const Interrupted end = interrupted(folder, SIGINT, [&] {
    return command(add_conform_command,
                   {"conform", fixtures + "hostile-one-particle.h5", fixtures + "pour-56k-stream.h5", "--backend",
                    "hash", "--executor", "host", "--report", report, "--junit", junit});
  });
  EXPECT_EQ(end.status, 128 + SIGINT) << end.out;
  EXPECT_NE(end.out.find(" of 2 judged"), std::string::npos) << end.out;
  EXPECT_NE(end.out.find("interrupted"), std::string::npos) << end.out;
  const Report kept = read_report(report);
  const CheckRow& last = kept.rows.back();
  EXPECT_EQ(last.fixture, "pour-56k-stream");
  EXPECT_EQ(last.verdict, Verdict::not_run);
  EXPECT_EQ(last.reason, "interrupted");
  EXPECT_EQ(kept.rows.front().fixture, "hostile-one-particle");
  EXPECT_NE(kept.provenance.at("interrupted").find(" of 2 judged"), std::string::npos);
  EXPECT_EQ(kept.provenance.count("git_revision"), 1u);
  EXPECT_NE(bytes_of(junit).find("pour-56k-stream"), std::string::npos);
}

TEST(InterruptedCommand, BenchKeepsItsRows) {
  const TemporaryFolder folder;
  const std::string json = folder / "bench.json";
  const Interrupted end = interrupted(folder, SIGTERM, [&] {
    return command(add_bench_command,
                   {"bench", fixtures + "pour-56k-stream.h5", "--backend", "reference:all-pairs", "--report", json});
  });
  EXPECT_EQ(end.status, 128 + SIGTERM) << end.out;
  EXPECT_NE(end.out.find("interrupted: 0 of 1 timed"), std::string::npos) << end.out;
  const auto kept = nlohmann::json::parse(bytes_of(json));
  EXPECT_EQ(kept.at("rows").size(), 0u);
  EXPECT_EQ(kept.at("interrupted").get<std::string>(), "interrupted: 0 of 1 timed or refused");
}

TEST(InterruptedCommand, ValidateKeepsTableAndReport) {
  const TemporaryFolder folder;
  const std::string report = folder / "report.h5";
  const Interrupted end = interrupted(folder, SIGINT, [&] {
    return command(add_validate_command, {"validate", "still-tank", "--resolution", "40", "--report", report});
  });
  EXPECT_EQ(end.status, 128 + SIGINT) << end.out;
  EXPECT_NE(end.out.find("interrupted: 0 of 1 runs judged"), std::string::npos) << end.out;
  EXPECT_EQ(Hdf5Reader(report).text_attribute("/provenance", "interrupted"), "interrupted: 0 of 1 runs judged");
}

TEST(InterruptedCommand, DriftKeepsTableAndReport) {
  const TemporaryFolder folder;
  const std::string report = folder / "report.h5";
  const Interrupted end = interrupted(folder, SIGINT, [&] {
    return command(add_drift_command,
                   {"drift", fixtures + "pour-56k-stream.h5", "--executor", "host", "--report", report});
  });
  EXPECT_EQ(end.status, 128 + SIGINT) << end.out;
  EXPECT_NE(end.out.find("interrupted: 0 of 1 windows measured"), std::string::npos) << end.out;
  EXPECT_EQ(Hdf5Reader(report).text_attribute("/provenance", "interrupted"), "interrupted: 0 of 1 windows measured");
}

}  // namespace
}  // namespace decant
