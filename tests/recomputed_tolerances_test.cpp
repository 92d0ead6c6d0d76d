/// \file
/// The documents say how every tolerance is made: a script that follows their formulas, apart from the code
/// here, finds the same numbers.
#include "oracle/checks/conform.hpp"
#include "oracle/files/port_inputs.hpp"
#include "oracle/files/report_file.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tests/edited_reference.hpp"
#include "tests/forms.hpp"
#include "tests/python.hpp"
#include "tests/results_fixture.hpp"

namespace decant {
namespace {

/// What the script says of the tolerances in a report in which every value is wrong, so that all are kept.
int status_of(const Fixture& fixture) {
  const TemporaryFolder folder;
  const std::filesystem::path inputs = folder / "inputs.h5", file = folder / "report.h5";
  const PreparedReference oracle = prepare_reference(fixture, {"fields"});
  write_port_inputs(inputs, fixture, oracle);
  test::Edit edit;
  edit.evaluated = [](const Scene&, Fields& f) {
    for (auto* values : {&f.boundary_volume, &f.density, &f.pressure}) values->setConstant(1e30);
    for (auto* values : {&f.pressure_acceleration, &f.viscous_acceleration, &f.wall_pressure_acceleration,
                         &f.wall_viscous_acceleration, &f.acceleration})
      values->setConstant(1e30);
  };
  test::EditedReference backend(edit);
  Report report;
  report.rows = run_checks(backend, fixture, oracle, {"fields"});
  write_report(file, report);
  return test::run_python({DECANT_SOURCE_DIR "/tests/recompute_tolerances.py", inputs.string(), file.string()});
}

class RecomputedTolerances : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::python_has("h5py,numpy")) GTEST_SKIP() << "no h5py; ci/setup makes it";
  }
};

TEST_F(RecomputedTolerances, FollowFromTheDocumentsInATiltingCup) { EXPECT_EQ(status_of(test::answered_fixture()), 0); }

/// Of every kernel, on a period and free, in tanks at rest and tilting.
TEST_F(RecomputedTolerances, FollowFromTheDocumentsOnRandomProblems) {
  std::set<KernelFamily> kernels;
  bool periodic = false, tilting = false;
  for (std::uint32_t seed = 1; seed < 200; ++seed) {
    const Fixture f = test::random_form_case(seed);
    const Scene& s = f.scene;
    const auto& axes = s.domain.periodic;
    const bool period = axes[0] || axes[1] || axes[2], tilt = !s.containers.empty() && s.containers[0].tilt.has_value();
    const bool walls = !s.containers.empty();
    const bool wanted = (walls && !kernels.count(s.kernel)) || (period && !periodic) || (tilt && !tilting);
    if (!wanted || f.state.size() < 20 || s.fluid.viscosity == 0) continue;
    if (walls) kernels.insert(s.kernel);
    periodic = periodic || period;
    tilting = tilting || tilt;
    EXPECT_EQ(status_of(f), 0) << f.name;
  }
  EXPECT_EQ(kernels.size(), 3u);
  EXPECT_TRUE(periodic && tilting);
}

}  // namespace
}  // namespace decant
