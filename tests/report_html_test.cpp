/// \file
/// The page of tools/python/report_html.py holds what the report does, and needs nothing from elsewhere.
#include "oracle/files/report_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "oracle/report/report.hpp"
#include "reference/state.hpp"
#include "tests/file_bytes.hpp"
#include "tests/python.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <regex>

namespace decant {
namespace {

CheckRow row(const std::string& fixture, const std::string& check, double score) {
  CheckRow r;
  r.backend = "hash";
  r.executor = "host";
  r.fixture = fixture;
  r.check = r.field = check;
  r.unit = "kg/m^3";
  r.n = 4000;
  r.tolerance = 1e-4;
  r.score = score;
  r.error = score * r.tolerance;
  r.median_score = score / 10;
  r.fp32_reference_score = 0.3;
  r.verdict = score <= 1 ? Verdict::pass : Verdict::fail;
  r.score_quantiles.assign(quantile_percent.size(), score / 10);
  r.score_quantiles.back() = score;
  return r;
}

Report failing_report() {
  Report report;
  report.provenance = {{"device.hash", "<host & more>"}};
  report.rows = {row("pour-4k-rest", "density", 0.5), row("pour-4k-stream", "density", 31),
                 row("pour-<56k>", "density", 0.25)};
  CheckRow& failing = report.rows[1];
  failing.worst_id = 17;
  failing.actual = 1003.25;
  failing.expected = 1000.5;
  failing.worst_x = failing.worst_y = failing.worst_z = 0.125;
  failing.fluid_neighbors = 33;
  failing.nearest = "4 9 2";
  CheckRow missing;
  missing.backend = "list";
  missing.executor = "cuda";
  missing.fixture = "pour-4k-splash";
  missing.check = "all";
  missing.reason = "no device";
  report.rows.push_back(missing);

  Neighborhood& s = report.neighborhood.emplace();
  s.row = 1;
  s.spacing = 0.004;
  s.support_radius = 0.008;
  s.position = Eigen::Matrix3Xd::Constant(3, 3, 0.125);
  s.position.row(0) << 0.125, 0.13, 0.135;
  s.id = IdVector::LinSpaced(3, 17, 19);
  s.wall = {0, 0, 1};
  s.density = s.error = s.tolerance = Eigen::VectorXd::Constant(3, 1.0);
  s.score = Eigen::Vector3d(31, std::numeric_limits<double>::infinity(), no_number);
  return report;
}

class ReportPage : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::python_has("h5py, jinja2, matplotlib"))
      GTEST_SKIP() << "no matplotlib in " << test::python() << "; ci/setup makes it";
  }
  int run() {
    return test::run_python({DECANT_SOURCE_DIR "/tools/python/report_html.py", (folder_ / "report.h5").string()});
  }
  std::string page() { return test::bytes_of(folder_ / "report.html"); }
  TemporaryFolder folder_;
};

TEST_F(ReportPage, NamesEveryFixtureAndFailureAndNeedsNothingFromElsewhere) {
  write_report(folder_ / "report.h5", failing_report());
  ASSERT_EQ(run(), 0);
  const std::string html = page();
  for (const char* part : {"pour-4k-rest", "pour-4k-stream", "pour-&lt;56k&gt;", "pour-4k-splash", "1003.25", "1000.5",
                           "4 9 2", "no device", "&lt;host &amp; more&gt;"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  std::size_t pictures = 0;
  for (auto at = html.find("<svg"); at != std::string::npos; at = html.find("<svg", at + 1)) ++pictures;
  EXPECT_EQ(pictures, 3u);  // distribution, three ways, slice
  EXPECT_EQ(html.find("<56k>"), std::string::npos);
  EXPECT_FALSE(std::regex_search(html, std::regex("https?:|//|@import|<link|<script|\\ssrc=")));
  // What is referred to is on the page or of it.
  EXPECT_FALSE(std::regex_search(html, std::regex("href=\"(?!#|data:)|url\\((?!#)")));
}

TEST_F(ReportPage, OfAnEmptyReportSaysThatNothingRan) {
  write_report(folder_ / "report.h5", {});
  ASSERT_EQ(run(), 0);
  EXPECT_NE(page().find("not run"), std::string::npos);
}

TEST_F(ReportPage, IsNotMadeOfWhatIsNoReport) {
  std::ofstream(folder_ / "report.h5") << "not HDF5";
  EXPECT_EQ(run(), 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "report.html"));
}

}  // namespace
}  // namespace decant
