/// \file
/// Fixtures and reports are what their documents say, as h5py sees them.
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/report_file.hpp"
#include "oracle/report/report.hpp"
#include "tests/python.hpp"
#include "tests/small_fixture.hpp"
#include "tools/validation/validation.hpp"

#include <gtest/gtest.h>

#include <filesystem>

namespace decant {
namespace {

/// Exit status of tools/python/check_schema.py on a file; its output goes to the test's.
int checked(const std::filesystem::path& file) {
  return test::run_python({DECANT_SOURCE_DIR "/tools/python/check_schema.py", file.string()});
}

class Schema : public FixtureFile {
 protected:
  void SetUp() override {
    FixtureFile::SetUp();
    if (!test::python_has("h5py")) GTEST_SKIP() << "no h5py in " << test::python() << "; ci/setup makes it";
  }
};

TEST_F(Schema, ASmallFixtureIsAsDocumented) { EXPECT_EQ(checked(file_), 0); }

TEST_F(Schema, AStudyScaleFixtureIsAsDocumented) {
  Fixture study = small_fixture();
  reduce_to_sample(study, 10);
  write_fixture(file_, study);
  EXPECT_EQ(checked(file_), 0);
}

TEST_F(Schema, AReportIsAsDocumented) {
  Report report;
  report.provenance = {{"version", "0"}};
  report.rows.resize(3);
  report.rows[0].verdict = Verdict::pass;
  CheckRow& whole = report.rows[1];
  whole.verdict = Verdict::fail;
  whole.unit = "Pa";
  whole.errors = Eigen::VectorXd::Constant(9, 2.0);
  whole.tolerances = Eigen::VectorXd::Constant(9, 1.0);
  report.rows[2] = whole;
  report.rows[2].errors = Eigen::VectorXd::Constant(2'000'000, 2.0);
  report.rows[2].tolerances = Eigen::VectorXd::Constant(2'000'000, 1.0);
  write_report(file_, report);
  EXPECT_EQ(checked(file_), 0);
  write_report(file_, {});
  EXPECT_EQ(checked(file_), 0);
}

TEST_F(Schema, AValidationIsAsDocumented) {
  validate::Result result;
  result.name = "case";
  result.add({"right", "m", 1, 1.01, 0.01, 0.02});
  result.curves.push_back({"panel", "found", "x", "m", "y", "Pa", false, {0, 1}, {2, 3}});
  validate::write(file_, {result});
  EXPECT_EQ(checked(file_), 0);
  validate::write(file_, {});
  EXPECT_EQ(checked(file_), 0);
}

TEST_F(Schema, AReportWithSurroundingsIsAsDocumented) {
  Report report;
  Neighborhood& s = report.neighborhood.emplace();
  s.position = Eigen::Matrix3Xd::Random(3, 5);
  s.id = IdVector::LinSpaced(5, 10, 14);
  s.wall = {0, 0, 0, 1, 1};
  s.density = s.error = s.tolerance = s.score = Eigen::VectorXd::Constant(5, 2.0);
  write_report(file_, report);
  EXPECT_EQ(checked(file_), 0);
  remove("/VTKHDF/PointData/score");
  EXPECT_EQ(checked(file_), 1);
  write_report(file_, report);
  remove_attribute("/VTKHDF", "Version");
  EXPECT_EQ(checked(file_), 1);
}

TEST_F(Schema, WhatIsNotAsDocumentedIsFound) {
  const std::string good = bytes();
  const auto n = static_cast<hsize_t>(small_fixture().state.size());
  remove("/oracle/density");
  EXPECT_EQ(checked(file_), 1);
  replace_bytes(good);
  reshape("/state/velocity", {n, 3});
  EXPECT_EQ(checked(file_), 1);
  replace_bytes(good);
  reshape("/condition/density", {n + 1});
  EXPECT_EQ(checked(file_), 1);
  replace_bytes("not HDF5");
  EXPECT_EQ(checked(file_), 2);
}

}  // namespace
}  // namespace decant
