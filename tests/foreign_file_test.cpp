/// \file
/// Files as other programs' libraries write them by default: what they hold arrives, and what ends or delays the process
/// that reads them is a refusal by name.
#include "oracle/files/foreign_file.hpp"

#include "tests/python.hpp"
#include "tests/results_fixture.hpp"

#include <sys/resource.h>

#include <fstream>
#include <string>

namespace decant {
namespace {

/// Files of x = 1, 2, 3, 4, written by plain h5py.
class ForeignFile : public test::ResultsFile {
 protected:
  void SetUp() override {
    if (!test::python_has("h5py")) GTEST_SKIP() << "no Python with h5py: ci/setup python";
  }
  /// \param fill  Python that fills `file`
  static void write(const std::filesystem::path& path, const std::string& arguments, const std::string& fill) {
    const std::string script = "import sys, h5py, numpy as np\nwith h5py.File(sys.argv[1], 'w'" + arguments +
                               ") as file:\n    file['fields/x'] = np.arange(1, 5, dtype=float)\n" + fill;
    ASSERT_EQ(test::run_python({"-c", script, path.string()}), 0);
  }
  static void write_reference(const std::string& arguments, const std::string& more = "") {
    write(reference_file(), arguments,
          "    file.attrs['decant_reference'] = 1\n    file['fields/x'].attrs['tolerance'] = 0.25\n"
          "    file['fields/x'].attrs['unit'] = 'm'\n" +
              more);
  }
  static void write_port(const std::string& arguments, const std::string& more = "") {
    write(results_file(), arguments,
          "    file.attrs['decant_results'] = 1\n    file.attrs['device'] = 'a δ device'\n"
          "    file['fields/x'].attrs['unit'] = 'm'\n" +
              more);
  }
  static ResultsOutcome judged() { return check_results_file({results_file(), {}, reference_file(), "port", {}}); }
  static InputError refused(std::chrono::milliseconds limit = std::chrono::minutes(1)) {
    try {
      (void)open_foreign(results_file(), limit);
    } catch (const InputError& error) {
      return error;
    }
    ADD_FAILURE() << "was accepted";
    return InputError("", "", "", "");
  }
};

TEST_F(ForeignFile, OfPlainH5pyIsRead) {
  for (const std::string arguments : {"", ", libver='v108'", ", libver='latest'"}) {
    write_reference(arguments);
    write_port(arguments);
    const ResultsOutcome outcome = judged();
    EXPECT_EQ(outcome.status, 0) << arguments;
    const CheckRow& row = row_of(outcome, "fields", "x");
    EXPECT_EQ(row.n, 4);
    EXPECT_EQ(row.unit, "m");
    EXPECT_EQ(row.device, "a δ device");
    write_port(arguments, "    file['fields/x'][2] += 0.5\n");
    EXPECT_EQ(judged().status, 1) << arguments;
  }
}

TEST_F(ForeignFile, KeepsTypesShapesAndAttributes) {
  write_port("", R"(
    file['a/b/half'] = np.array([[0.5, 1.5]], np.float16)
    file['a/b/big'] = np.array([-7, 7], '>i2')
    file['a/b/none'] = np.zeros((0, 3))
    file.create_dataset('a/b/chunked', data=np.arange(1000.0), compression='gzip', shuffle=True)
    file['a/b/half'].attrs['scale'] = np.float32(0.1)
    file['a'].attrs['many'] = np.arange(3)
    file['notes'] = 'beside the groups'
)");
  const Hdf5Reader in = open_foreign(results_file());
  EXPECT_EQ(in.file(), results_file());
  EXPECT_TRUE(in.has_checksums());
  EXPECT_EQ(in.reals("/a/b/half", 1), Eigen::Vector2d(0.5, 1.5));
  EXPECT_EQ(in.integers("/a/b/big"), (IdVector(2) << -7, 7).finished());
  EXPECT_EQ(in.matrix3("/a/b/none", 0).cols(), 0);
  EXPECT_EQ(in.vector("/a/b/chunked", 1000)[999], 999);
  EXPECT_EQ(in.real_attribute("/a/b/half", "scale"), 0.1F);
  EXPECT_FALSE(in.has_attribute("/a", "many"));
  EXPECT_FALSE(in.has("/notes"));
}

TEST_F(ForeignFile, ThatHoldsNoNumbersWhereNumbersBelongIsRefusedByName) {
  write_port("", "    file['fields/name'] = 'a text'\n");
  EXPECT_EQ(refused().key(), "/fields/name");
}

TEST_F(ForeignFile, MayLeadNowhereElse) {
  write_port("", "    file['fields/y'] = h5py.SoftLink('/fields/x')\n");
  const Hdf5Reader in = open_foreign(results_file());
  EXPECT_FALSE(in.has("/fields/y"));
}

TEST_F(ForeignFile, ThatIsCutOffIsRefused) {
  write_port("");
  std::filesystem::resize_file(results_file(), std::filesystem::file_size(results_file()) / 2);
  const InputError error = refused();
  EXPECT_EQ(error.file(), results_file());
  EXPECT_EQ(error.key(), "file");
}

TEST_F(ForeignFile, WhoseReaderNeedsTooLongIsRefused) {
  write_port("");
  EXPECT_EQ(refused(std::chrono::milliseconds(0)).value(), "not read within 0 s");
}

/// The system ends a process that writes more than it may.
TEST_F(ForeignFile, WhoseReaderIsEndedIsRefused) {
  write_port("");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit none{1, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &none);
  std::string value;
  try {
    (void)open_foreign(results_file());
  } catch (const InputError& error) {
    value = error.value();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(value, "its reader was ended by signal 25");
}

TEST_F(ForeignFile, LeavesNothingBehind) {
  const std::filesystem::path folder = *folder_ / "temporary";
  std::filesystem::create_directory(folder);
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  setenv("TMPDIR", folder.c_str(), 1);
  write_port("");
  EXPECT_EQ(open_foreign(results_file()).reals("/fields/x", 4)[3], 4);
  (void)refused(std::chrono::milliseconds(0));
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  if (before) setenv("TMPDIR", kept.c_str(), 1);
  else unsetenv("TMPDIR");
}

}  // namespace
}  // namespace decant
