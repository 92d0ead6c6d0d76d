/// \file
/// Files appear whole or not at all, come back bitwise, and are never believed.
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "reference/error.hpp"
#include "tests/file_bytes.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace decant {
namespace {

namespace fs = std::filesystem;

class Hdf5Io : public testing::Test {
 protected:
  fs::path at(const std::string& name) const { return folder_ / name; }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
  }

  TemporaryFolder folder_;
};

using test::bytes_of;

Eigen::VectorXd awkward_values() {
  Eigen::VectorXd v(6);
  v << 0.1, -0.0, std::numeric_limits<double>::denorm_min(), 1e308, std::numeric_limits<double>::infinity(),
      std::numeric_limits<double>::quiet_NaN();
  return v;
}

void write_everything(const fs::path& file) {
  Hdf5Writer out(file);
  out.attribute("/", "kind", "test");
  out.attribute("/group", "count", 7);
  out.attribute("/group", "length", 0.25);
  out.vector("/group/values", awkward_values(), "m", "some values");
  out.matrix3("/group/points", Eigen::Matrix3Xd::Random(3, 1000), "m");
  out.integers("/ids", IdVector::LinSpaced(5, -2, 2));
  out.bytes("/places", {0, 1, 255});
  out.strings("/names", {"α", "", "a longer one"});
  out.text("/scene", "{\"name\": \"π\"}");
  out.commit();
}

/// The InputError that `read` must end in.
InputError refused(const std::function<void()>& read) {
  try {
    read();
  } catch (const InputError& error) {
    return error;
  }
  ADD_FAILURE() << "was accepted";
  return InputError("", "", "", "");
}

TEST_F(Hdf5Io, WhatIsWrittenComesBackBitwise) {
  std::srand(1);
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 100000);
  Hdf5Writer out(at("a.h5"));
  out.vector("/v", awkward_values(), "m");
  out.matrix3("/deep/down/points", points, "m/s");
  out.commit();
  const Hdf5Reader in(at("a.h5"));
  const Eigen::VectorXd back = in.vector("/v", 6), sent = awkward_values();
  EXPECT_EQ(std::memcmp(back.data(), sent.data(), 6 * sizeof(double)), 0);
  EXPECT_EQ(in.matrix3("/deep/down/points", 100000), points);
  EXPECT_EQ(in.text_attribute("/deep/down/points", "unit"), "m/s");
  EXPECT_EQ(in.shape("/deep/down/points"), (std::vector<std::int64_t>{100000, 3}));
}

TEST_F(Hdf5Io, SinglePrecisionStorageRoundsToNearest) {
  Hdf5Writer out(at("a.h5"));
  out.vector("/v", Eigen::VectorXd::Constant(3, 0.1), "m", {}, Storage::fp32);
  out.commit();
  EXPECT_EQ(Hdf5Reader(at("a.h5")).vector("/v")[2], static_cast<double>(0.1f));
}

TEST_F(Hdf5Io, StringsIntegersAndAttributesComeBack) {
  write_everything(at("a.h5"));
  const Hdf5Reader in(at("a.h5"));
  EXPECT_EQ(in.strings("/names"), (std::vector<std::string>{"α", "", "a longer one"}));
  EXPECT_EQ(in.text("/scene"), "{\"name\": \"π\"}");
  EXPECT_EQ(in.integers("/places")[2], 255);
  EXPECT_EQ(in.integers("/ids", 5)[0], -2);
  EXPECT_EQ(in.text_attribute("/", "kind"), "test");
  EXPECT_EQ(in.integer_attribute("/group", "count"), 7);
  EXPECT_EQ(in.real_attribute("/group", "length"), 0.25);
  EXPECT_EQ(in.children("/group"), (std::vector<std::string>{"points", "values"}));
  EXPECT_EQ(in.attribute_names("/group"), (std::vector<std::string>{"count", "length"}));
  EXPECT_TRUE(in.has("/group/values"));
  EXPECT_FALSE(in.has("/group/nothing/below"));
}

TEST_F(Hdf5Io, EmptyDatasetsComeBackEmpty) {
  Hdf5Writer out(at("a.h5"));
  out.vector("/v", {}, "m");
  out.matrix3("/p", Eigen::Matrix3Xd(3, 0), "m");
  out.strings("/s", {});
  out.text("/t", "");
  out.commit();
  const Hdf5Reader in(at("a.h5"));
  EXPECT_EQ(in.vector("/v", 0).size(), 0);
  EXPECT_EQ(in.matrix3("/p", 0).cols(), 0);
  EXPECT_TRUE(in.strings("/s").empty());
  EXPECT_EQ(in.text("/t"), "");
}

TEST_F(Hdf5Io, TheSameContentGivesTheSameBytes) {
  std::srand(3);
  write_everything(at("a.h5"));
  ::sleep(1);
  std::srand(3);
  write_everything(at("b.h5"));
  EXPECT_EQ(bytes_of(at("a.h5")), bytes_of(at("b.h5")));
}

TEST_F(Hdf5Io, WithoutCommitNothingIsLeft) {
  {
    Hdf5Writer(at("a.h5")).vector("/v", awkward_values(), "m");
  }
  EXPECT_EQ(files(), 0u);
}

TEST_F(Hdf5Io, AKillInMidWriteLeavesNothingUnderTheFinalName) {
  write_everything(at("old.h5"));
  const std::string before = bytes_of(at("old.h5"));
  for (const char* name : {"new.h5", "old.h5"}) {
    const pid_t child = fork();
    if (child == 0) {
      Hdf5Writer out(at(name));
      out.matrix3("/p", Eigen::Matrix3Xd::Random(3, 1000), "m");
      _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
  }
  EXPECT_FALSE(fs::exists(at("new.h5")));
  EXPECT_EQ(bytes_of(at("old.h5")), before);
}

TEST_F(Hdf5Io, AFullDiskIsAnErrorThatNamesTheFileAndLeavesNothing) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{20000, 20000};
    setrlimit(RLIMIT_FSIZE, &limit);
    int result = 1;
    try {
      Hdf5Writer out(at("a.h5"));
      out.matrix3("/p", Eigen::Matrix3Xd::Random(3, 100000), "m");
      out.commit();
    } catch (const std::runtime_error& error) {
      result = std::string(error.what()).find("a.h5") == std::string::npos ? 2 : 0;
    }
    std::exit(result);  // with HDF5's own clean-up, which must survive the failure
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(files(), 0u);
}

TEST_F(Hdf5Io, AFolderThatIsMissingIsAnErrorThatNamesTheFile) {
  try {
    Hdf5Writer out(at("no/such/folder.h5"));
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("no/such/folder.h5: cannot be written: No such file"), std::string::npos)
        << error.what();
  }
  EXPECT_THROW(Hdf5Writer{folder_.path()}, std::runtime_error);
}

TEST_F(Hdf5Io, AWrongPathClassRankOrLengthIsNamed) {
  write_everything(at("a.h5"));
  const Hdf5Reader in(at("a.h5"));
  struct Case {
    std::function<void()> read;
    std::string key, value, bound;
  };
  const std::vector<Case> cases = {
      {[&] { in.vector("/nothing"); }, "/nothing", "missing", "required"},
      {[&] { in.vector("/group"); }, "/group", "a group", "a dataset"},
      {[&] { in.children("/ids"); }, "/ids", "a dataset", "a group"},
      {[&] { in.vector("/ids"); }, "/ids", "int64 [5]", "reals [N]"},
      {[&] { in.vector("/group/values", 5); }, "/group/values", "float64 [6]", "reals [5]"},
      {[&] { in.vector("/group/points"); }, "/group/points", "float64 [1000,3]", "reals [N]"},
      {[&] { in.matrix3("/group/values", 2); }, "/group/values", "float64 [6]", "reals [2,3]"},
      {[&] { in.integers("/names"); }, "/names", "string [3]", "integers [N]"},
      {[&] { in.strings("/scene"); }, "/scene", "string scalar", "fixed-length strings [N]"},
      {[&] { in.text("/names"); }, "/names", "string [3]", "fixed-length strings scalar"},
      {[&] { in.text_attribute("/group", "x"); }, "/group@x", "missing", "a fixed-length string"},
      {[&] { in.text_attribute("/group", "count"); }, "/group@count", "int64 scalar", "a fixed-length string"},
      {[&] { in.integer_attribute("/group", "length"); }, "/group@length", "float64 scalar", "an integer"},
  };
  for (const auto& c : cases) {
    const InputError error = refused(c.read);
    EXPECT_EQ(error.file(), at("a.h5").string());
    EXPECT_EQ(error.key(), c.key);
    EXPECT_EQ(error.value(), c.value) << c.key;
    EXPECT_EQ(error.bound(), c.bound) << c.key;
  }
}

TEST_F(Hdf5Io, LinksThatLeadElsewhereAreRefused) {
  write_everything(at("other.h5"));
  write_everything(at("a.h5"));
  const hid_t file = H5Fopen(at("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  H5Lcreate_external("other.h5", "/ids", file, "/external", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_soft("/ids", file, "/soft", H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(file);
  const Hdf5Reader in(at("a.h5"));
  EXPECT_EQ(refused([&] { in.integers("/external"); }).value(), "a link");
  EXPECT_EQ(refused([&] { in.integers("/soft"); }).key(), "/soft");
}

TEST_F(Hdf5Io, ClaimsBeyondTheFileAreRefusedBeforeMemoryIsAskedFor) {
  write_everything(at("a.h5"));
  const hid_t file = H5Fopen(at("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hsize_t huge[2] = {hsize_t{1} << 45, 3};
  const hid_t space = H5Screate_simple(2, huge, nullptr);
  const hid_t chunked = H5Pcreate(H5P_DATASET_CREATE);
  const hsize_t chunk[2] = {4096, 3};
  H5Pset_chunk(chunked, 2, chunk);
  H5Dclose(H5Dcreate2(file, "/chunked", H5T_IEEE_F64LE, space, H5P_DEFAULT, chunked, H5P_DEFAULT));
  H5Dclose(H5Dcreate2(file, "/whole", H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  const hsize_t small[2] = {10000, 3}, first[2] = {1, 3}, zero[2] = {0, 0};
  const hid_t partial_space = H5Screate_simple(2, small, nullptr);
  const hid_t partial = H5Dcreate2(file, "/partial", H5T_IEEE_F64LE, partial_space, H5P_DEFAULT, chunked, H5P_DEFAULT);
  const hid_t memory = H5Screate_simple(2, first, nullptr);
  H5Sselect_hyperslab(partial_space, H5S_SELECT_SET, zero, nullptr, first, nullptr);
  const double row[3] = {1, 2, 3};
  H5Dwrite(partial, H5T_NATIVE_DOUBLE, memory, partial_space, H5P_DEFAULT, row);
  H5Dclose(partial);
  H5Fclose(file);

  const Hdf5Reader in(at("a.h5"));
  EXPECT_EQ(refused([&] { in.matrix3("/chunked"); }).value(), "float64 [35184372088832,3]");
  EXPECT_EQ(refused([&] { in.matrix3("/whole"); }).key(), "/whole");
  const InputError error = refused([&] { in.matrix3("/partial"); });
  EXPECT_EQ(error.value(), "1 chunks");
  EXPECT_EQ(error.bound(), "3 chunks");
}

TEST_F(Hdf5Io, StringsOfVariableLengthAreRefused) {
  write_everything(at("a.h5"));
  const hid_t file = H5Fopen(at("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
  H5Tset_size(type, H5T_VARIABLE);
  const hid_t attribute = H5Acreate2(file, "vague", type, space, H5P_DEFAULT, H5P_DEFAULT);
  const char* text = "text";
  H5Awrite(attribute, type, &text);
  H5Aclose(attribute);
  H5Fclose(file);
  const Hdf5Reader in(at("a.h5"));
  EXPECT_EQ(refused([&] { in.text_attribute("/", "vague"); }).value(), "variable-length string scalar");
}

TEST_F(Hdf5Io, AnUnsignedNumberBeyondInt64IsRefusedNotClipped) {
  write_everything(at("a.h5"));
  const hid_t file = H5Fopen(at("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hsize_t one = 1;
  const hid_t space = H5Screate_simple(1, &one, nullptr);
  const hid_t data = H5Dcreate2(file, "/u", H5T_STD_U64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const std::uint64_t value = std::uint64_t{1} << 63;
  H5Dwrite(data, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value);
  H5Dclose(data);
  H5Fclose(file);
  EXPECT_EQ(refused([&] { Hdf5Reader(at("a.h5")).integers("/u"); }).value(), "9223372036854775808");
}

TEST_F(Hdf5Io, WhatIsNotAWholeHdf5FileIsRefused) {
  write_everything(at("good.h5"));
  const std::string good = bytes_of(at("good.h5"));
  std::ofstream(at("empty.h5")).flush();
  std::ofstream(at("text.h5")) << "{\"name\": \"not HDF5\"}\n";
  EXPECT_EQ(refused([&] { Hdf5Reader in(at("absent.h5")); }).value(), "not found");
  EXPECT_EQ(refused([&] { Hdf5Reader in(folder_.path()); }).value(), "a folder");
  EXPECT_EQ(refused([&] { Hdf5Reader in(at("empty.h5")); }).value(), "empty");
  EXPECT_EQ(refused([&] { Hdf5Reader in(at("text.h5")); }).key(), "file");
  for (std::size_t length : {std::size_t{4}, std::size_t{100}, good.size() / 2, good.size() - 1}) {
    std::ofstream(at("cut.h5"), std::ios::binary) << good.substr(0, length);
    const InputError error = refused([&] { Hdf5Reader in(at("cut.h5")); });
    EXPECT_EQ(error.file(), at("cut.h5").string());
    EXPECT_EQ(error.bound(), "a whole HDF5 file") << length;
  }
}

}  // namespace
}  // namespace decant
