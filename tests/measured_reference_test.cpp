/// \file
/// A solver of somebody else as the reference: a correct port passes by measured bounds, a wrong one fails where it is
/// wrong, and a reference that cannot be one is refused or named.
#include "oracle/checks/measured_reference.hpp"

#include "oracle/solution/reference_backend.hpp"
#include "reference/error.hpp"
#include "tests/built_files.hpp"
#include "tests/edited_reference.hpp"
#include "tests/results_fixture.hpp"
#include "tests/shell_output.hpp"
#include "tests/small_fixture.hpp"
#include "tools/commands/backend_choice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

namespace decant {
namespace {

using test::Edit;
using test::EditedReference;

std::string recording(const std::string& name) { return DECANT_SOURCE_DIR "/fixtures/" + name + ".h5"; }

/// "check / field" of all rows with this verdict.
std::set<std::string> rows_with(Verdict verdict, const std::vector<CheckRow>& rows) {
  std::set<std::string> found;
  for (const CheckRow& row : rows)
    if (row.verdict == verdict) found.insert(row.check + " / " + row.field);
  return found;
}

class MeasuredReference : public testing::Test {
 protected:
  /// Rows of an edited solver by a reference without edit.
  static std::vector<CheckRow> judged(const Edit& edit, const Edit& of_reference = {}) {
    const Fixture fixture = test::answered_fixture();
    EditedReference reference(of_reference), port(edit);
    const CheckSelection checks{"fields", "substep", "invariance"};
    return run_checks(port, fixture, measured_reference(reference, fixture, checks), checks);
  }
};

TEST_F(MeasuredReference, OfTheSameFormulasPassesWhatDerivedBoundsPass) {
  const auto reference = make_reference_backend();
  for (const std::string name : {"hostile-periodic", "hostile-bowl", "hostile-exact-support", "motion-drum"}) {
    const Fixture fixture = read_fixture(recording(name));
    const PreparedReference measured = measured_reference(*reference, fixture, measured_checks());
    for (const std::string choice : {"hash", "list"}) {
      const auto backend = choose_backend(choice, "host");
      const auto rows = run_checks(*backend, fixture, measured, measured_checks());
      EXPECT_EQ(rows_with(Verdict::fail, rows), std::set<std::string>()) << name << ' ' << choice;
      EXPECT_GT(rows_with(Verdict::pass, rows).size(), 30U);
    }
  }
}

/// Of most values: two particles in nearly one place have a direction that the last bit of a position decides.
TEST_F(MeasuredReference, HasBoundsOfTheSizeOfDerivedOnes) {
  const Fixture fixture = read_fixture(recording("hostile-periodic"));
  const auto reference = make_reference_backend();
  const PreparedReference measured = measured_reference(*reference, fixture, {"fields"});
  const PreparedReference derived = prepare_reference(fixture, {"fields"});
  const auto ratio = [](const auto& a, const auto& b) {
    Eigen::VectorXd all = (a.array() / b.array()).reshaped();
    std::nth_element(all.begin(), all.begin() + all.size() / 2, all.end());
    return all[all.size() / 2];
  };
  EXPECT_GT(ratio(measured.own.tolerance.density, derived.own.tolerance.density), 1);
  EXPECT_LT(ratio(measured.own.tolerance.density, derived.own.tolerance.density), 64);
  EXPECT_GT(ratio(measured.given.tolerance.acceleration, derived.given.tolerance.acceleration), 1);
  EXPECT_LT(ratio(measured.given.tolerance.acceleration, derived.given.tolerance.acceleration), 64);
}

TEST_F(MeasuredReference, FindsAWrongSignAndNothingElse) {
  Edit edit;
  edit.evaluated = [](const Scene&, Fields& f) {
    f.acceleration -= 2 * f.pressure_acceleration;
    f.pressure_acceleration = -f.pressure_acceleration;
  };
  const auto failing = rows_with(Verdict::fail, judged(edit));
  EXPECT_TRUE(failing.count("acceleration / pressure_acceleration"));
  EXPECT_TRUE(failing.count("invariance / permuted acceleration"));
  for (const std::string fine : {"density / density", "pressure / pressure", "acceleration / viscous_acceleration",
                                 "neighbors / fluid_neighbor_count"})
    EXPECT_FALSE(failing.count(fine)) << fine;
}

TEST_F(MeasuredReference, FindsAMissingNeighborADriftAndANaN) {
  Edit missing;
  missing.found = [](const Scene&, Neighbors& near, Eigen::VectorXd&) {
    for (auto& list : near.fluid)
      if (!list.empty()) return list.pop_back();
  };
  EXPECT_TRUE(rows_with(Verdict::fail, judged(missing)).count("neighbors / fluid_neighbor_count"));
  Edit drift;
  drift.advanced = [](ParticleState& s) { s.position.array() += 1e-4; };
  EXPECT_TRUE(rows_with(Verdict::fail, judged(drift)).count("substep / position"));
  Edit nan;
  nan.evaluated = [](const Scene&, Fields& f) { f.density[3] = std::nan(""); };
  EXPECT_TRUE(rows_with(Verdict::fail, judged(nan)).count("density / density"));
}

TEST_F(MeasuredReference, ThatIsNotFiniteIsNoReference) {
  Edit nan;
  nan.evaluated = [](const Scene&, Fields& f) { f.acceleration(1, 2) = std::nan(""); };
  try {
    (void)judged({}, nan);
    FAIL() << "was accepted";
  } catch (const BackendError& error) {
    EXPECT_STREQ(error.what(), "the reference edited: acceleration 2 is nan");
  }
}

std::string conform(const std::string& arguments, int status) {
  const test::ShellOutput out = test::shell_output(test::command() + " conform hostile-periodic-box " + arguments);
  EXPECT_EQ(out.status, status) << out.text;
  return out.text;
}

TEST_F(MeasuredReference, IsNamedOnTheCommandLine) {
  const std::string said = conform("--oracle reference --backend 'plugin:" + test::plugin_file("all_pairs") + "'", 0);
  EXPECT_NE(said.find("oracle: reference: 1 CPU core; bounds measured on 16 copies"), std::string::npos) << said;
  EXPECT_NE(conform("--oracle hash --backend list", 2).find("a reference in fp64; this one computes in fp32"),
            std::string::npos);
  EXPECT_NE(conform("--oracle reference --check contact", 2).find("one of conservation, containment"),
            std::string::npos);
  EXPECT_NE(conform("--oracle reference --results none.h5", 2).find("a file with --results"), std::string::npos);
  EXPECT_NE(conform("--oracle nothing.h5", 2).find("--results"), std::string::npos);
}

}  // namespace
}  // namespace decant
