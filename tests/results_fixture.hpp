/// \file
/// A small fixture with the oracle's own answer, walls that move included, and files of results
/// beside it.
#pragma once

#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tests/small_fixture.hpp"
#include "tools/commands/check_results_file.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

namespace decant::test {

/// Jittered water in a beaker that tilts, recorded as `decant record` does.
inline Fixture answered_fixture() {
  Fixture f = small_fixture();
  f.scene.containers[0].tilt = Tilt{Vec3(0.05, 0, 0.1), Vec3::UnitY(), {{0.0, 0.0}, {1.0, 1.2}}};
  f.state.position += 0.1 * f.scene.particle_spacing * Eigen::Matrix3Xd::Random(3, f.state.size());
  f.state.velocity *= 0.1;
  f.state.quantise();
  evaluate_oracle(f.scene, f.state, *f.fields, *f.condition);
  return f;
}

class ResultsFile : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    write_fixture(fixture_file(), answered_fixture());
    fixture_ = std::make_unique<Fixture>(read_fixture(fixture_file()));
    oracle_ = std::make_unique<PreparedReference>(
        prepare_reference(*fixture_, {"fields", "substep", "conservation"}, 0, Staged::as_computed));
  }
  static void TearDownTestSuite() {
    oracle_.reset();
    fixture_.reset();
    folder_.reset();
  }

  static std::filesystem::path fixture_file() { return *folder_ / "beaker.h5"; }
  static std::filesystem::path results_file() { return *folder_ / "theirs.h5"; }
  static std::filesystem::path reference_file() { return *folder_ / "reference.h5"; }

  /// A results file of the fixture, filled by the test.
  static void write(const std::function<void(Hdf5Writer&)>& fill) {
    Hdf5Writer out(results_file());
    out.attribute("/", "decant_results", 1);
    out.attribute("/", "fixture_sha256", fixture_->sha256);
    fill(out);
    out.commit();
  }
  static ResultsOutcome judged() { return check_results_file({results_file(), {fixture_file()}, "", "port", {}}); }
  /// Asserts that the command refuses the files, naming this key.
  static void expect_refused(const std::function<ResultsOutcome()>& judge, const std::string& key) {
    try {
      judge();
      ADD_FAILURE() << "was accepted; expected a complaint about " << key;
    } catch (const InputError& error) {
      EXPECT_EQ(error.key(), key) << error.what();
    }
  }
  static const CheckRow& row_of(const ResultsOutcome& outcome, const std::string& check, const std::string& field) {
    for (const CheckRow& row : outcome.report.rows)
      if (row.check == check && row.field == field) return row;
    throw std::runtime_error("no row " + check + " / " + field);
  }

  inline static std::unique_ptr<TemporaryFolder> folder_;
  inline static std::unique_ptr<Fixture> fixture_;
  inline static std::unique_ptr<PreparedReference> oracle_;
};

}  // namespace decant::test
