/// \file
/// Reports say what was found, and never more: a pass without a score is none.
#include "oracle/report/report.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/report_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "oracle/report/console_table.hpp"
#include "reference/error.hpp"
#include "tests/special_values.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include <unistd.h>

namespace decant {
namespace {

namespace fs = std::filesystem;
using test::nan;

CheckRow row(const std::string& backend, const std::string& fixture, const std::string& check, double score) {
  CheckRow r;
  r.backend = backend;
  r.executor = "host";
  r.device = "2 OpenMP threads";
  r.fixture = fixture;
  r.check = r.field = check;
  r.unit = "kg/m^3";
  r.n = 4000;
  r.tolerance = 1e-4;
  r.score = score;
  r.error = score * r.tolerance;
  r.median_score = score / 10;
  r.fp32_reference_score = 0.3;
  r.worst_id = 17;
  r.verdict = score <= 1 ? Verdict::pass : Verdict::fail;
  if (r.verdict == Verdict::fail) r.reason = "score above 1";
  return r;
}

CheckRow not_run(const std::string& backend, const std::string& fixture) {
  CheckRow r;
  r.backend = backend;
  r.executor = "cuda";
  r.fixture = fixture;
  r.check = "all";
  r.reason = "no CUDA device";
  return r;
}

/// With arrays of n values whose largest score is the row's.
CheckRow with_arrays(CheckRow r, Eigen::Index n) {
  r.tolerances = Eigen::VectorXd::Constant(n, r.tolerance);
  r.errors = Eigen::VectorXd::Random(n).cwiseAbs() * (0.9 * r.error);
  r.errors[n / 2] = r.error;
  return r;
}

class ReportFile : public testing::Test {
 protected:
  TemporaryFolder folder_;
  const fs::path file_ = folder_ / "report.h5";
};

TEST_F(ReportFile, TheSummarysColumnsAreOfEqualLength) {
  Report report;
  for (int k = 0; k < 7; ++k) report.rows.push_back(row("brute", "pour", "density", 0.1 * k));
  write_report(file_, report);
  const Hdf5Reader in(file_);
  EXPECT_EQ(in.integer_attribute("/", "decant_report"), 3);
  const auto columns = in.children("/summary");
  EXPECT_EQ(columns.size(), 10u + 1 + 6 + 10 + 9);
  for (const auto& column : columns) EXPECT_EQ(in.shape("/summary/" + column), std::vector<std::int64_t>{7}) << column;
}

TEST_F(ReportFile, RowsAndProvenanceComeBack) {
  Report report;
  report.rows = {row("brute", "pour-4k-stream", "density", 0.25), row("hash", "α", "pressure", 30),
                 not_run("list", "pour")};
  report.rows[0].excluded = 3;
  report.rows[1].actual = 1001;
  report.rows[1].expected = 1000;
  report.rows[1].worst_component = 2;
  report.rows[1].worst_x = 0.5;
  report.rows[1].wall_neighbors = 40;
  report.rows[1].nearest = "4 8 1";
  report.provenance = {{"version", "0.1.0"}, {"compiler", "g++ 12"}};
  write_report(file_, report);
  const Report back = read_report(file_);
  ASSERT_EQ(back.rows.size(), 3u);
  EXPECT_EQ(back.rows[0].fixture, "pour-4k-stream");
  EXPECT_EQ(back.rows[0].score, 0.25);
  EXPECT_EQ(back.rows[0].excluded, 3);
  EXPECT_EQ(back.rows[0].verdict, Verdict::pass);
  EXPECT_EQ(back.rows[1].fixture, "α");
  EXPECT_EQ(back.rows[1].verdict, Verdict::fail);
  EXPECT_EQ(back.rows[1].reason, "score above 1");
  EXPECT_EQ(back.rows[2].verdict, Verdict::not_run);
  EXPECT_TRUE(std::isnan(back.rows[0].expected));
  EXPECT_EQ(in_full(back.rows[1]), in_full(report.rows[1]));
  EXPECT_EQ(back.provenance, report.provenance);
}

/// As version 0.1 wrote it.
void make_schema_2(const std::filesystem::path& file) {
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  for (const auto& [now, before] :
       {std::pair("error", "value"), std::pair("fp32_reference_score", "float_score"), std::pair("actual", "got")})
    ASSERT_GE(H5Lmove(id, (std::string("/summary/") + now).c_str(), id, (std::string("/summary/") + before).c_str(),
                      H5P_DEFAULT, H5P_DEFAULT),
              0);
  const hid_t schema = H5Aopen(id, "decant_report", H5P_DEFAULT);
  const std::int64_t two = 2;
  ASSERT_GE(H5Awrite(schema, H5T_NATIVE_INT64, &two), 0);
  H5Aclose(schema);
  H5Fclose(id);
}

TEST_F(ReportFile, OfTheSchemaBeforeReadsAsToday) {
  Report report;
  report.rows = {row("brute", "pour", "density", 0.25), row("hash", "pour", "turned density", 30)};
  report.rows[1].check = "invariance";
  report.rows[1].actual = 1001;
  write_report(file_, report);
  make_schema_2(file_);
  const Report back = read_report(file_);
  ASSERT_EQ(back.rows.size(), 2u);
  EXPECT_EQ(back.rows[0].field, "density");
  EXPECT_EQ(back.rows[0].error, report.rows[0].error);
  EXPECT_EQ(back.rows[0].fp32_reference_score, report.rows[0].fp32_reference_score);
  EXPECT_EQ(back.rows[1].field, "rotated density");
  EXPECT_EQ(back.rows[1].actual, 1001);
}

TEST_F(ReportFile, AnEmptyReportCanBeWrittenAndIsNoPass) {
  write_report(file_, {});
  EXPECT_TRUE(read_report(file_).rows.empty());
  EXPECT_EQ(Hdf5Reader(file_).text_attribute("/", "verdict"), "not_run");
  EXPECT_EQ(exit_status({}), 3);
}

TEST_F(ReportFile, AFailingCheckKeepsItsArraysAndAPassingOneItsQuantiles) {
  std::srand(2);
  Report report;
  report.rows = {with_arrays(row("brute", "pour", "density", 0.5), 1001),
                 with_arrays(row("brute", "pour", "pressure", 30), 1001)};
  const Eigen::VectorXd error = report.rows[1].errors;
  for (auto& r : report.rows) condense(r);
  EXPECT_EQ(report.rows[0].errors.size(), 0);
  write_report(file_, report);
  const Hdf5Reader in(file_);
  EXPECT_EQ(in.children("/checks"), std::vector<std::string>{"000001"});
  EXPECT_EQ(in.text_attribute("/checks/000001", "check"), "pressure");
  EXPECT_EQ(in.text_attribute("/checks/000001", "kept"), "whole");
  EXPECT_EQ(in.text_attribute("/checks/000001/error", "unit"), "kg/m^3");
  EXPECT_TRUE(in.vector("/checks/000001/error", 1001).isApprox(error, 1e-6));
  EXPECT_EQ(in.vector("/checks/000001/tolerance", 1001)[5], static_cast<double>(1e-4f));
  const Eigen::VectorXd highest = in.vector("/summary/score_p100", 2);
  EXPECT_NEAR(highest[0], 0.5, 1e-12);
  EXPECT_NEAR(highest[1], 30, 1e-9);
  EXPECT_LT(in.vector("/summary/score_p50")[0], highest[0]);
  EXPECT_EQ(read_report(file_).rows[0].score_quantiles.size(), 9u);
}

TEST_F(ReportFile, ANanAmongTheErrorsShowsInTheDistribution) {
  CheckRow r = with_arrays(row("brute", "pour", "density", 0.5), 100);
  r.errors[3] = nan;
  condense(r);
  EXPECT_EQ(r.score_quantiles.back(), std::numeric_limits<double>::infinity());
}

TEST_F(ReportFile, StaysBelowFifteenMegabytesHoweverMuchFails) {
  std::srand(5);
  Report report;
  const CheckRow large = with_arrays(row("brute", "pour-56k-stream", "acceleration", 30), 168000);
  for (int k = 0; k < 30; ++k) report.rows.push_back(large);
  CheckRow small = with_arrays(row("hash", "pour-4k-splash", "density", 4), 4000);
  for (int k = 0; k < 3000; ++k) {
    small.error = k;
    report.rows.push_back(small);
  }
  write_report(file_, report);
  EXPECT_LT(fs::file_size(file_), 15'000'000u);
  const Hdf5Reader in(file_);
  EXPECT_EQ(in.text_attribute("/checks/000000", "kept"), "whole");
  EXPECT_EQ(in.text_attribute("/checks/000029", "kept"), "worst");
  EXPECT_EQ(in.integers("/checks/000029/index", 256)[0], 84000);
  EXPECT_EQ(in.vector("/checks/000029/error")[0], static_cast<float>(large.error));
  EXPECT_EQ(in.shape("/summary/score"), std::vector<std::int64_t>{3030});
}

/// What VTK's reader asks of PolyData: every group of cells, an offset more than cells.
TEST_F(ReportFile, SurroundingsAreVertices) {
  Report report{{row("brute", "pour", "density", 31)}, {}};
  Neighborhood& s = report.neighborhood.emplace();
  s.row = 0;
  s.position = Eigen::Matrix3Xd::Random(3, 5);
  s.id = IdVector::LinSpaced(5, 10, 14);
  s.wall = {0, 0, 0, 1, 1};
  s.density = s.error = s.tolerance = s.score = Eigen::VectorXd::Constant(5, 2.0);
  write_report(file_, report);
  EXPECT_FALSE(read_report(file_).neighborhood);
  const Hdf5Reader in(file_);
  EXPECT_EQ(in.text_attribute("/VTKHDF", "Type"), "PolyData");
  EXPECT_EQ(in.integers("/VTKHDF/NumberOfPoints", 1)[0], 5);
  EXPECT_TRUE(in.matrix3("/VTKHDF/Points", 5).isApprox(s.position, 1e-6));
  EXPECT_EQ(in.integers("/VTKHDF/PointData/id", 5), s.id);
  EXPECT_EQ(in.integers("/VTKHDF/Vertices/Offsets", 6)[5], 5);
  for (const char* kind : {"Lines", "Polygons", "Strips"}) {
    const std::string group = std::string("/VTKHDF/") + kind;
    EXPECT_EQ(in.integers(group + "/NumberOfCells", 1)[0], 0);
    EXPECT_EQ(in.integers(group + "/Offsets", 1)[0], 0);
    EXPECT_EQ(in.integers(group + "/Connectivity", 0).size(), 0);
  }
}

TEST_F(ReportFile, ADamagedReportIsRefusedByName) {
  write_report(file_, {{row("brute", "pour", "density", 0.1)}, {}});
  const hid_t file = H5Fopen(file_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Ldelete(file, "/summary/score", H5P_DEFAULT);
  H5Fclose(file);
  try {
    read_report(file_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.key(), "/summary/score");
  }
}

TEST(ReportVerdict, APassNeedsAScoreBetweenZeroAndOne) {
  for (const double score : {0.0, 0.5, 1.0}) EXPECT_EQ(verdict_of(row("b", "f", "c", score)), Verdict::pass) << score;
  for (const double score : {nan, 1.0 + 1e-15, -0.1, std::numeric_limits<double>::infinity()}) {
    CheckRow r = row("b", "f", "c", 0.5);
    r.score = score;
    EXPECT_EQ(verdict_of(r), Verdict::fail) << score;
    EXPECT_NE(reason_of(r).find("said to pass with score"), std::string::npos);
  }
}

TEST(ReportVerdict, APassNeedsNumbersForValueAndTolerance) {
  CheckRow r = row("b", "f", "c", 0.5);
  r.error = nan;
  EXPECT_EQ(verdict_of(r), Verdict::fail);
  r = row("b", "f", "c", 0.5);
  r.tolerance = nan;
  EXPECT_EQ(verdict_of(r), Verdict::fail);
}

TEST(ReportVerdict, ASkippedOrFailedRowKeepsItsVerdictWhateverItsScore) {
  EXPECT_EQ(verdict_of(not_run("b", "f")), Verdict::not_run);
  CheckRow r = row("b", "f", "c", 0.5);
  r.verdict = Verdict::fail;
  EXPECT_EQ(verdict_of(r), Verdict::fail);
}

TEST(ReportVerdict, TheExitStatusIsZeroOnlyWhereEverythingPassed) {
  const CheckRow good = row("b", "f", "c", 0.5), bad = row("b", "f", "d", 2);
  EXPECT_EQ(exit_status({{good, good}, {}}), 0);
  EXPECT_EQ(exit_status({{good, bad}, {}}), 1);
  EXPECT_EQ(exit_status({{good, not_run("b", "f")}, {}}), 3);
  EXPECT_EQ(exit_status({{bad, not_run("b", "f")}, {}}), 1);
  CheckRow lie = good;
  lie.score = nan;
  EXPECT_EQ(exit_status({{good, lie}, {}}), 1);
}

TEST(ReportTable, ShowsWorstScoreAndEndsInOneLine) {
  const Report report{{row("brute", "pour-4k-stream", "density", 0.25), row("brute", "pour-4k-stream", "pressure", 0.5),
                       row("brute", "pour-4k-rest", "density", 0.1)},
                      {}};
  const std::string table = console_table(report);
  EXPECT_NE(table.find("pour-4k-stream  pass             0.5  pressure\n"), std::string::npos) << table;
  EXPECT_TRUE(table.ends_with("\n2 fixtures × 1 backend: pass\n")) << table;
}

TEST(ReportTable, ShowsEveryFailingRowInFull) {
  Report report{{row("brute", "pour", "density", 0.25), row("hash", "pour", "density", 31),
                 row("hash", "pour", "pressure", 7), not_run("list", "pour")},
                {}};
  const std::string table = console_table(report);
  EXPECT_NE(table.find("fail: hash host on pour: density\n"
                       "    particle 17: error 0.0031 kg/m^3, tolerance 0.0001 kg/m^3, score 31"),
            std::string::npos)
      << table;
  EXPECT_NE(table.find("fail: hash host on pour: pressure"), std::string::npos);
  EXPECT_NE(table.find("not_run: list cuda on pour: all\n    no CUDA device\n"), std::string::npos) << table;
  EXPECT_TRUE(table.ends_with("1 fixture × 3 backends: fail (1 of 3 fail, 1 of 3 not run)\n")) << table;
}

TEST(ReportTable, ANanScoreIsTheWorstAndReadsAsFail) {
  CheckRow lie = row("brute", "pour", "pressure", 0.5);
  lie.score = nan;
  const std::string table =
      console_table({{row("brute", "pour", "density", 0.25), lie, row("brute", "pour", "acceleration", 0.75)}, {}});
  EXPECT_NE(table.find("fail             nan  pressure"), std::string::npos) << table;
  EXPECT_TRUE(table.ends_with("fail (1 of 1 fail)\n")) << table;
}

TEST(ReportTable, ACheckThatFailsByCountIsNamedBeforeOneThatPassesWithAHigherScore) {
  CheckRow counted = row("brute", "pour", "neighbors", 0);
  counted.unit = "1";
  counted.verdict = Verdict::fail;
  counted.reason = "40 ambiguous particles, at most 12 expected";
  const std::string table = console_table({{row("brute", "pour", "density", 0.25), counted}, {}});
  EXPECT_NE(table.find("fail               0  neighbors\n"), std::string::npos) << table;
  EXPECT_NE(table.find("error 0, tolerance 0.0001, score 0"), std::string::npos) << table;
}

TEST(ReportTable, StaysWithinAHundredColumns) {
  CheckRow r = row("brute", std::string(150, 'x'), std::string(80, 'y'), 1e9);
  r.options = std::string(60, 'o');
  r.field = std::string(50, 'f');
  r.reason = std::string(300, 'z') + " and a sentence that goes on for a while after that word";
  std::istringstream lines(console_table({{r}, {}}));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
}

TEST(ReportTable, NothingJudgedIsNotAPass) { EXPECT_EQ(verdict_line({}), "nothing was judged: not_run"); }

}  // namespace
}  // namespace decant
