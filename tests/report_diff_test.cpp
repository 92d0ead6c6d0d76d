/// \file
/// What changed is told, and what got worse is never told as no worse.
#include "oracle/report/report_diff.hpp"
#include "oracle/files/report_file.hpp"

#include "oracle/files/temporary_folder.hpp"
#include "reference/error.hpp"
#include "reference/scene.hpp"
#include "tests/special_values.hpp"
#include "tools/commands/commands.hpp"

#include <gtest/gtest.h>

#include <sstream>

namespace decant {
namespace {

using test::nan;

CheckRow row(const std::string& check, double score, const std::string& backend = "brute") {
  CheckRow r;
  r.backend = backend;
  r.executor = "host";
  r.fixture = "pour-4k-rest";
  r.check = r.field = check;
  r.unit = "kg/m^3";
  r.n = 4000;
  r.tolerance = 1e-4;
  r.score = score;
  r.error = score * r.tolerance;
  r.worst_id = 17;
  r.verdict = score <= 1 ? Verdict::pass : Verdict::fail;
  if (r.verdict == Verdict::fail) r.reason = "beyond tolerance";
  return r;
}

CheckRow not_run(const std::string& check) {
  CheckRow r = row(check, 0);
  r.verdict = Verdict::not_run;
  r.n = 0;
  r.reason = "no device";
  return r;
}

TEST(ReportDiff, OfAReportFromItselfIsEmpty) {
  const Report report{{row("density", 0.5), row("pressure", nan), not_run("substep")}, {{"version", "1"}}};
  const ReportDiff diff = difference(report, report);
  EXPECT_FALSE(diff.got_worse());
  EXPECT_EQ(diff_text(diff), "3 rows in both: nothing moved: no worse\n");
}

TEST(ReportDiff, GetsWorseWhereAPassDoesNotStayOne) {
  const Report good{{row("density", 0.5)}, {}};
  CheckRow lie = row("density", 0.5);
  lie.score = nan;
  for (const Report& bad :
       {Report{{row("density", 31)}, {}}, Report{{not_run("density")}, {}}, Report{{}, {}}, Report{{lie}, {}}}) {
    EXPECT_TRUE(difference(good, bad).got_worse());
    EXPECT_TRUE(diff_text(difference(good, bad)).ends_with(": worse\n"));
    EXPECT_FALSE(difference(bad, good).got_worse());
  }
}

TEST(ReportDiff, RowsAreTheSameWhereBackendOptionsExecutorFixtureCheckAndFieldAre) {
  const CheckRow base = row("density", 0.5);
  EXPECT_EQ(difference({{base}, {}}, {{base}, {}}).compared, 1u);
  for (auto member : {&CheckRow::backend, &CheckRow::options, &CheckRow::executor, &CheckRow::fixture, &CheckRow::check,
                      &CheckRow::field}) {
    CheckRow other = base;
    other.*member += "x";
    const ReportDiff diff = difference({{base}, {}}, {{other}, {}});
    EXPECT_EQ(diff.compared, 0u);
    EXPECT_EQ(diff.only_before.size(), 1u);
    EXPECT_EQ(diff.only_after.size(), 1u);
  }
  CheckRow elsewhere = base;
  elsewhere.device = "another machine";
  EXPECT_EQ(difference({{base}, {}}, {{elsewhere}, {}}).compared, 1u);
}

TEST(ReportDiff, RowsThatOccurTwiceAreMatchedInOrder) {
  const Report before{{row("density", 0.5), row("density", 31)}, {}};
  const Report after{{row("density", 0.5), row("density", 0.5)}, {}};
  const ReportDiff diff = difference(before, after);
  EXPECT_EQ(diff.compared, 2u);
  EXPECT_EQ(diff.better.size(), 1u);
  EXPECT_TRUE(difference(after, before).got_worse());
}

TEST(ReportDiff, AFailingRowThatIsGoneIsToldAndIsNoWorse) {
  const ReportDiff diff = difference({{row("density", 31)}, {}}, {});
  EXPECT_EQ(diff.only_before.size(), 1u);
  EXPECT_FALSE(diff.got_worse());
}

TEST(ReportDiff, ScoresMoveWhereTheyLeaveTheFactor) {
  const auto moved = [](double a, double b, double factor) {
    const ReportDiff diff = difference({{row("density", a)}, {}}, {{row("density", b)}, {}}, factor);
    return static_cast<int>(diff.grown.size()) - static_cast<int>(diff.shrunk.size());
  };
  EXPECT_EQ(moved(0.25, 0.5, 2), 0);
  EXPECT_EQ(moved(0.25, 0.51, 2), 1);
  EXPECT_EQ(moved(0.51, 0.25, 2), -1);
  EXPECT_EQ(moved(0.25, 0.51, 3), 0);
  EXPECT_EQ(moved(0, 0.1, 100), 1);
  EXPECT_EQ(moved(0.1, 0, 100), -1);
  EXPECT_EQ(moved(0, 0, 2), 0);
  EXPECT_EQ(moved(5, nan, 2), 1);
  EXPECT_EQ(moved(nan, 5, 2), -1);
  EXPECT_EQ(moved(infinity, infinity, 2), 0);
}

TEST(ReportDiff, TheTextBeginsWithWhatGotWorseAndEndsWithTheWhole) {
  const Report before{{row("density", 0.5), row("pressure", 31), row("substep", 0.1)},
                      {{"version", "1"}, {"compiler", "g++"}}};
  const Report after{{row("density", 31), row("pressure", 0.5), row("substep", 0.4)},
                     {{"version", "2"}, {"compiler", "g++"}, {"flags", "-O2"}}};
  const std::string text = diff_text(difference(before, after));
  EXPECT_TRUE(
      text.starts_with("worse: pass -> fail, score 0.5 -> 31: brute host on pour-4k-rest: "
                       "density\n    particle 17: error 0.0031 kg/m^3"))
      << text;
  EXPECT_NE(text.find("better: fail -> pass, score 31 -> 0.5"), std::string::npos) << text;
  EXPECT_NE(text.find("grown: score 0.1 -> 0.4 (4 times)"), std::string::npos) << text;
  EXPECT_NE(text.find("\nflags: - -> -O2\nversion: 1 -> 2\n"), std::string::npos) << text;
  EXPECT_TRUE(
      text.ends_with("\n\n3 rows in both: 1 worse, 1 better, 1 moved more than 2 "
                     "times: worse\n"))
      << text;
}

TEST(ReportDiff, TheTextStaysWithinAHundredColumns) {
  CheckRow long_row = row(std::string(80, 'y'), 0.5);
  long_row.options = std::string(60, 'o');
  long_row.fixture = std::string(120, 'x');
  CheckRow bad = long_row;
  bad.score = 1e9;
  bad.verdict = Verdict::fail;
  std::istringstream lines(
      diff_text(difference({{long_row, row("a", 1)}, {{"k", std::string(300, 'v')}}}, {{bad}, {}})));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
}

/// Exit status of `decant diff`, and what it printed.
int diff_command(const std::vector<std::string>& arguments, std::string* out = nullptr) {
  CLI::App app;
  int status = -1;
  add_diff_command(app, status);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  reversed.push_back("diff");
  testing::internal::CaptureStdout();
  try {
    app.parse(reversed);
  } catch (...) {
    testing::internal::GetCapturedStdout();
    throw;
  }
  const std::string printed = testing::internal::GetCapturedStdout();
  if (out) *out = printed;
  return status;
}

TEST(DiffCommand, ExitsWithOneWhereSomethingGotWorse) {
  const TemporaryFolder folder;
  const std::string good = (folder / "good.h5").string(), bad = (folder / "bad.h5").string();
  write_report(good, {{row("density", 0.5)}, {}});
  write_report(bad, {{row("density", 31)}, {}});
  EXPECT_EQ(diff_command({good, good}), exit_pass);
  EXPECT_EQ(diff_command({good, bad}), exit_does_not_conform);
  EXPECT_EQ(diff_command({bad, good}), exit_pass);
  std::string out;
  EXPECT_EQ(diff_command({good, bad, "--json"}, &out), exit_does_not_conform);
  EXPECT_NE(out.find("\"exit_status\": 1"), std::string::npos) << out;
  EXPECT_EQ(diff_command({good, bad, "--quiet"}, &out), exit_does_not_conform);
  EXPECT_EQ(out, "1 rows in both: 1 worse: worse\n");
}

TEST(DiffCommand, SaysThatNamesDifferAndHowToPairThem) {
  const TemporaryFolder folder;
  const std::string hash = (folder / "hash.h5").string(), mine = (folder / "mine.h5").string();
  CheckRow its = row("density", 31, "mine");
  its.executor = "";
  write_report(hash, {{row("density", 0.5, "hash"), row("pressure", 0.5, "hash")}, {}});
  write_report(mine, {{its}, {}});
  try {
    diff_command({hash, mine});
    ADD_FAILURE() << "was not refused";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), mine);
    EXPECT_EQ(error.value(), "mine ");
    EXPECT_NE(error.bound().find("hash host"), std::string::npos) << error.bound();
    EXPECT_NE(error.bound().find("--pair \"hash=mine\""), std::string::npos) << error.bound();
  }
  std::string out;
  EXPECT_EQ(diff_command({hash, mine, "--pair", "hash=mine", "--quiet"}, &out), exit_does_not_conform);
  EXPECT_EQ(out, "1 rows in both: 1 worse, 1 only before: worse\n");
  EXPECT_EQ(diff_command({mine, hash, "--pair", "mine=hash host", "--quiet"}, &out), exit_pass);
  EXPECT_THROW(diff_command({hash, mine, "--pair", "hash=brute"}), InputError);
  EXPECT_THROW(diff_command({hash, mine, "--pair", "hash"}), InputError);
  EXPECT_THROW(diff_command({hash, mine, "--spread", "pour"}), InputError);
}

TEST(DiffCommand, RefusesWhatIsNoReportAndAFactorBelowOne) {
  const TemporaryFolder folder;
  const std::string good = (folder / "good.h5").string();
  write_report(good, {{row("density", 0.5)}, {}});
  EXPECT_THROW(diff_command({good, (folder / "none.h5").string()}), InputError);
  EXPECT_THROW(diff_command({good, good, "--factor", "0.5"}), CLI::ParseError);
}

}  // namespace
}  // namespace decant
