/// \file
/// A damaged or hostile fixture is refused by name; it never crashes and never passes.
#include "oracle/files/fixture_file.hpp"
#include "oracle/solution/digest.hpp"
#include "tests/small_fixture.hpp"
#include "tests/special_values.hpp"

#include <cmath>
#include <limits>
#include <tuple>

#ifdef __SANITIZE_ADDRESS__
/// HDF5 does not free what it had read of an object when the rest turns out damaged.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }
#endif

namespace decant {
namespace {

using test::nan;
constexpr double infinite = std::numeric_limits<double>::infinity();

class DamagedFixture : public FixtureFile {};

TEST_F(DamagedFixture, AnAbsentFileIsRefused) {
  std::filesystem::remove(file_);
  expect_refused("file", "not found", "an HDF5 file");
}

TEST_F(DamagedFixture, AFolderIsRefused) {
  std::filesystem::remove(file_);
  std::filesystem::create_directory(file_);
  expect_refused("file", "a folder", "an HDF5 file");
}

TEST_F(DamagedFixture, AnEmptyFileIsRefused) {
  replace_bytes("");
  expect_refused("file", "empty", "an HDF5 file");
}

TEST_F(DamagedFixture, TextIsRefused) {
  replace_bytes(scene_to_json(small_scene()));
  expect_refused("file", "signature", "a whole HDF5 file");
}

TEST_F(DamagedFixture, AFileCutAtAnyOfFortyLengthsIsRefused) {
  const std::string good = bytes();
  for (std::size_t k = 1; k <= 40; ++k) {
    replace_bytes(good.substr(0, good.size() * k / 41));
    expect_refused("file", "", "a whole HDF5 file");
  }
}

TEST_F(DamagedFixture, DamageAnywhereInTheFileNeverCrashes) {
  const std::string good = bytes();
  // --gtest_shuffle --gtest_random_seed=K tries other damage.
  std::srand(static_cast<unsigned>(11 + testing::UnitTest::GetInstance()->random_seed()));
  for (int k = 0; k < 400; ++k) {
    std::string bad = good;
    // Metadata lies at the front and between the datasets; hit both.
    const std::size_t span = k % 2 ? good.size() : std::size_t{4096};
    for (int hit = 0; hit < 1 + k % 7; ++hit)
      bad[static_cast<std::size_t>(std::rand()) % span] = static_cast<char>(std::rand());
    replace_bytes(bad);
    try {
      read_fixture(file_);  // some bytes are padding
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), file_.string());
    }
  }
}

/// Deflated bytes that are whole in themselves, but shorter than a chunk.
TEST_F(DamagedFixture, AChunkThatInflatesToLessThanItIsIsRefused) {
  edit([](hid_t file) {
    const hid_t data = H5Dopen2(file, "/oracle/density", H5P_DEFAULT);
    const unsigned char eight_zeros[] = {0x78, 0x9c, 0x63, 0x60, 0x80, 0x01, 0x00, 0x00, 0x08, 0x00, 0x01};
    const hsize_t start = 0;
    H5Dwrite_chunk(data, H5P_DEFAULT, 0, &start, sizeof eight_zeros, eight_zeros);
    H5Dclose(data);
  });
  expect_refused("/oracle/density", "chunk 0 of 1", "whole");
}

TEST_F(DamagedFixture, AnotherSchemaVersionIsRefused) {
  set_attribute("/", "decant_fixture", H5T_NATIVE_INT64, std::int64_t{1});
  expect_refused("/@decant_fixture", "1", "2");
}

TEST_F(DamagedFixture, AnotherProgramsFileIsRefused) {
  remove_attribute("/", "decant_fixture");
  expect_refused("/@decant_fixture", "missing", "an integer");
}

TEST_F(DamagedFixture, AVersionThatIsTextIsRefused) {
  set_text("/", "decant_fixture", "1");
  expect_refused("/@decant_fixture", "string", "an integer");
}

TEST_F(DamagedFixture, AMissingPhaseIsRefused) {
  remove_attribute("/", "phase");
  expect_refused("/@phase", "missing", "a fixed-length string");
  set_text("/", "phase", "");
  expect_refused("/@phase", "\"\"", "a name");
}

TEST_F(DamagedFixture, EachMissingGroupIsNamed) {
  const std::vector<std::pair<std::string, std::string>> groups = {{"/scene", "/scene"},
                                                                   {"/state", "/state/position"},
                                                                   {"/walls", "/walls"},
                                                                   {"/oracle", "/oracle/boundary_volume"},
                                                                   {"/condition", "/condition/density"},
                                                                   {"/provenance", "/provenance"}};
  const std::string good = bytes();
  for (const auto& [group, key] : groups) {
    replace_bytes(good);
    remove(group);
    expect_refused(key, "missing", "required");
  }
}

TEST_F(DamagedFixture, EachMissingDatasetIsNamed) {
  const std::string good = bytes();
  for (const std::string path :
       {"/state/velocity", "/oracle/density", "/oracle/acceleration", "/oracle/wall_neighbor_id_sum",
        "/condition/density_pose", "/condition/wall_viscous_acceleration"}) {
    replace_bytes(good);
    remove(path);
    expect_refused(path, "missing", "required");
  }
}

TEST_F(DamagedFixture, WrongShapesAreRefused) {
  const std::string good = bytes();
  const auto n = static_cast<hsize_t>(small_fixture().state.size());
  const std::string length = std::to_string(n);
  struct Case {
    const char* path;
    std::vector<hsize_t> dims;
    std::string bound;
  };
  const std::vector<Case> cases = {
      {"/state/position", {n, 2}, "reals [N,3]"},
      {"/state/position", {3 * n}, "reals [N,3]"},
      {"/state/position", {n, 3, 1}, "reals [N,3]"},
      {"/state/velocity", {n - 1, 3}, "reals [" + length + ",3]"},
      {"/state/velocity", {0, 3}, "reals [" + length + ",3]"},
      {"/oracle/density", {n + 1}, "reals [" + length + "]"},
      {"/oracle/acceleration", {n}, "reals [" + length + ",3]"},
      {"/oracle/boundary_volume", {n}, "reals ["},
      {"/condition/density", {n, 3}, "reals [" + length + "]"},
  };
  for (const auto& c : cases) {
    replace_bytes(good);
    reshape(c.path, c.dims);
    expect_refused(c.path, "float64 [", c.bound);
  }
}

TEST_F(DamagedFixture, WrongClassesAreRefused) {
  const auto n = static_cast<hsize_t>(small_fixture().state.size());
  reshape("/oracle/density", {n}, H5T_STD_I32LE);
  expect_refused("/oracle/density", "int32 [", "reals [");
  reshape("/oracle/density", {n});
  reshape("/oracle/fluid_neighbor_count", {n}, H5T_IEEE_F32LE);
  expect_refused("/oracle/fluid_neighbor_count", "float32 [", "integers [");
}

TEST_F(DamagedFixture, AGroupInADatasetsPlaceIsRefused) {
  remove("/oracle/density");
  edit([](hid_t file) { H5Gclose(H5Gcreate2(file, "/oracle/density", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)); });
  expect_refused("/oracle/density", "a group", "a dataset");
}

TEST_F(DamagedFixture, AbsurdExtentsAreRefusedWithoutAskingForTheMemory) {
  reshape("/state/position", {hsize_t{1} << 50, 3});
  expect_refused("/state/position", "float64 [1125899906842624,3]", "bytes are there");
}

TEST_F(DamagedFixture, ValuesThatAreNotFiniteAreRefused) {
  const std::string good = bytes();
  for (const std::string path :
       {"/state/position", "/state/velocity", "/oracle/density", "/oracle/pressure", "/oracle/acceleration",
        "/oracle/boundary_volume", "/condition/density", "/condition/viscous_acceleration"})
    for (const double value : {nan, infinite, -infinite}) {
      replace_bytes(good);
      spoil(path, value);
      expect_refused(path, std::isnan(value) ? "nan at 0" : "inf at 0", "finite");
    }
}

TEST_F(DamagedFixture, AStateThatIsNotSinglePrecisionIsRefused) {
  const auto n = static_cast<hsize_t>(small_fixture().state.size());
  reshape("/state/position", {n, 3});
  spoil("/state/position", 0.1);
  expect_refused("/state/position", "0.1 at 0, x", "representable in fp32");
  spoil("/state/position", 1e300);
  expect_refused("/state/position", "1e+300 at 0, x", "representable in fp32");
}

TEST_F(DamagedFixture, ValuesOutOfRangeAreRefused) {
  const std::string good = bytes();
  const std::vector<std::tuple<std::string, double, std::string>> cases = {{"/oracle/density", 0, "> 0"},
                                                                           {"/oracle/boundary_volume", -1, "> 0"},
                                                                           {"/oracle/wall_neighbor_count", -1, ">= 0"},
                                                                           {"/condition/density_pose", -1, ">= 0"}};
  for (const auto& [path, value, bound] : cases) {
    replace_bytes(good);
    spoil(path, value);
    expect_refused(path, " at 0", bound);
  }
}

TEST_F(DamagedFixture, ATimeThatIsNotSubstepsTimesDtIsRefused) {
  set_attribute("/state", "time", H5T_NATIVE_DOUBLE, 0.2501);
  expect_refused("/state@time", "0.2501", "0.25");
  set_attribute("/state", "time", H5T_NATIVE_DOUBLE, nan);
  expect_refused("/state@time", "nan", "0.25");
}

TEST_F(DamagedFixture, ANegativeSubstepIsRefused) {
  set_attribute("/state", "substep", H5T_NATIVE_INT64, std::int64_t{-250});
  set_attribute("/state", "time", H5T_NATIVE_DOUBLE, -0.25);
  expect_refused("/state@substep", "-250", ">= 0");
}

TEST_F(DamagedFixture, ASceneThatDoesNotBelongToItsDigestIsRefused) {
  set_text("/provenance", "scene_sha256", std::string(64, '0'));
  expect_refused("/provenance@scene_sha256", "000", "as /scene has");
}

TEST_F(DamagedFixture, ABrokenSceneIsRefusedWithItsKey) {
  std::string text = scene_to_json(small_scene());
  const auto at = text.find("\"viscosity\"");
  ASSERT_NE(at, std::string::npos);
  std::string unknown = text;
  unknown.replace(at, 11, "\"viscosiTy\"");
  set_scene(unknown);
  expect_refused("/scene: fluid.viscosiTy", "", "");
  set_scene(text.substr(0, text.size() / 2));
  try {
    read_fixture(file_);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), file_.string());
    EXPECT_EQ(error.key().rfind("/scene", 0), 0u) << error.what();
  }
}

TEST_F(DamagedFixture, ASceneWhoseWallsWouldFillTheMemoryIsRefused) {
  Scene scene = small_scene();
  scene.particle_spacing = 1e-6;
  set_scene(scene_to_json(scene));
  expect_refused("/scene: particle_spacing", "1e-06", "wall particles");
}

TEST_F(DamagedFixture, WallsSampledOtherwiseThanAtTheRecordingAreRefused) {
  const Walls walls = sample_walls(small_scene());
  set_attribute("/walls", "count", H5T_NATIVE_INT64, std::int64_t{walls.size() + 1});
  expect_refused("/walls@count", std::to_string(walls.size() + 1), "re-record");
  set_attribute("/walls", "count", H5T_NATIVE_INT64, std::int64_t{walls.size()});
  set_text("/walls", "sha256", std::string(64, 'f'));
  expect_refused("/walls@sha256", "fff", digest_of(walls));
}

TEST_F(DamagedFixture, ASampleThatDoesNotAscendOrLeavesTheStateIsRefused) {
  Fixture study = small_fixture();
  reduce_to_sample(study, 10);
  write_fixture(file_, study);
  const std::string good = bytes();
  spoil("/sample/id", 1e6);
  expect_refused("/sample/id", "1000000 at 0", "ascending, below");
  replace_bytes(good);
  remove_attribute("/sample", "fields_sha256");
  expect_refused("/sample@fields_sha256", "missing", "a fixed-length string");
  replace_bytes(good);
  spoil("/sample/density", nan);
  expect_refused("/sample/density", "nan at 0", "finite");
}

}  // namespace
}  // namespace decant
