/// \file
/// A port in another language: the example conforms, each of its faults fails the check that is
/// there for it, and the Python writers give what the documents say.
#include "oracle/files/port_inputs.hpp"
#include "tests/python.hpp"
#include "tests/results_fixture.hpp"

#include <cstdlib>
#include <ostream>

namespace decant {
namespace {

const std::string root = DECANT_SOURCE_DIR;

int schema_of(const std::filesystem::path& file) {
  return test::run_python({root + "/tools/python/check_schema.py", file.string()});
}

class ForeignPort : public test::ResultsFile {
 protected:
  void SetUp() override {
    if (!test::python_has("h5py")) GTEST_SKIP() << "no h5py in " << test::python() << "; ci/setup makes it";
    setenv("PYTHONPATH", (root + "/tools/python").c_str(), 1);  // for scripts that import the writers
    write_port_inputs(inputs_file(), *fixture_, *oracle_);
  }
  static std::filesystem::path inputs_file() { return *folder_ / "inputs.h5"; }
  static int run_port(const std::string& fault) {
    return test::run_python({root + "/tools/python/numpy_port.py", inputs_file().string(), "--out",
                             results_file().string(), "--fault", fault});
  }
};

TEST_F(ForeignPort, ThatIsRightConforms) {
  ASSERT_EQ(run_port("none"), 0);
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 0) << outcome.table;
  EXPECT_EQ(row_of(outcome, "acceleration", "acceleration").device, "numpy");
  EXPECT_EQ(row_of(outcome, "acceleration", "wall_viscous_acceleration").verdict, Verdict::pass);
  EXPECT_EQ(row_of(outcome, "substep", "position").verdict, Verdict::not_run);
}

TEST_F(ForeignPort, WritesFilesAsDocumented) {
  EXPECT_EQ(schema_of(inputs_file()), 0);
  ASSERT_EQ(run_port("none"), 0);
  EXPECT_EQ(schema_of(results_file()), 0);
  write([&](Hdf5Writer& out) { out.integers("/fields/density", IdVector::Ones(fixture_->state.size())); });
  EXPECT_EQ(schema_of(results_file()), 1) << "density in integers";
}

struct PortFault {
  const char* name;
  const char* check;  // that must catch it
  const char* field;
  const char* clean_check;  // that must not be blamed
  const char* clean_field;
};
void PrintTo(const PortFault& fault, std::ostream* out) { *out << fault.name; }

class FaultyPort : public ForeignPort, public testing::WithParamInterface<PortFault> {};

TEST_P(FaultyPort, FailsTheCheckThatIsThereForIt) {
  const PortFault& fault = GetParam();
  ASSERT_EQ(run_port(fault.name), 0);
  const ResultsOutcome outcome = judged();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(row_of(outcome, fault.check, fault.field).verdict, Verdict::fail) << outcome.table;
  EXPECT_EQ(row_of(outcome, fault.clean_check, fault.clean_field).verdict, Verdict::pass) << outcome.table;
}

INSTANTIATE_TEST_SUITE_P(
    EachFault, FaultyPort,
    testing::Values(PortFault{"viscosity", "acceleration", "viscous_acceleration", "acceleration",
                              "wall_viscous_acceleration"},
                    PortFault{"neighbor", "neighbors", "fluid_neighbor_count", "neighbors", "wall_neighbor_count"},
                    PortFault{"volume", "boundary_volume", "boundary_volume", "acceleration", "pressure_acceleration"},
                    PortFault{"self", "density", "density", "acceleration", "acceleration"},
                    PortFault{"wall-at-rest", "acceleration", "wall_viscous_acceleration", "acceleration",
                              "wall_pressure_acceleration"},
                    PortFault{"nan", "density", "density", "pressure", "pressure"}),
    [](const testing::TestParamInfo<PortFault>& of) {
      std::string name = of.param.name;
      std::erase(name, '-');
      return name;
    });

TEST_F(ForeignPort, OfAnotherSolverIsBoundByItsPairSums) {
  const auto script = *folder_ / "pairs.py";
  std::ofstream(script) << R"(
import sys
import numpy as np
from results_file import field, pair_sums, write_reference, write_results

random = np.random.default_rng(1)
n, i, j = 50, *np.triu_indices(50, 1)
terms = random.normal(size=(len(i), 3))

def summed(terms):
    out = np.zeros((n, 3), terms.dtype)
    np.add.at(out, i, terms)
    np.add.at(out, j, -terms)
    return out

sums, count = pair_sums(n, i, j, terms)
assert (count == n - 1).all()
np.testing.assert_allclose(sums[0], np.abs(terms[i == 0]).sum(axis=0))
force = field(summed(terms), "N", condition=sums, terms=count)
write_reference(sys.argv[1], {"force": force}, id=np.arange(n) + 1)
order = random.permutation(n)
got = summed(terms.astype(np.float32)) * np.float32(sys.argv[3])
write_results(sys.argv[2], {"force": got[order]}, id=order + 1)
)";
  const auto judged_with = [&](const std::string& factor) {
    EXPECT_EQ(test::run_python({script.string(), reference_file().string(), results_file().string(), factor}), 0);
    return check_results_file({results_file(), {}, reference_file(), "port", {}}).status;
  };
  EXPECT_EQ(judged_with("1"), 0);
  EXPECT_EQ(schema_of(reference_file()), 0);
  EXPECT_EQ(schema_of(results_file()), 0);
  EXPECT_EQ(judged_with("1.0001"), 1);
}

TEST_F(ForeignPort, MayRewriteAFileOfAnyHdf5) {
  const auto script = *folder_ / "plain.py";
  std::ofstream(script) << R"(
import sys
import h5py
with h5py.File(sys.argv[1], "w", libver=("earliest", "v108")) as file:
    file.attrs["decant_results"] = 1
    file.attrs["device"] = "a string of any length"
    file.attrs["particles"] = int(sys.argv[2])
)";
  const auto plain = *folder_ / "plain.h5";
  ASSERT_EQ(test::run_python({script.string(), plain.string(), std::to_string(fixture_->state.size())}), 0);
  ASSERT_EQ(
      test::run_python({root + "/tools/python/results_file.py", plain.string(), "--out", results_file().string()}), 0);
  EXPECT_EQ(judged().status, 3) << "is read, and gives nothing";
}

}  // namespace
}  // namespace decant
