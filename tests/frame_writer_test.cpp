/// \file
/// What a frame looks like on the disk: HDF5, CSV, XDMF, and the thread that puts it there.
#include "tools/frames/frame_file.hpp"

#include "oracle/checks/audit.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "reference/error.hpp"
#include "tests/falling_points.hpp"
#include "tests/file_bytes.hpp"
#include "tools/frames/csv_writer.hpp"
#include "tools/frames/make_frame.hpp"
#include "tools/frames/xdmf.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>
#include <utility>

namespace decant {
namespace {

constexpr std::int64_t particles = 7;

/// Floats that need all their digits, tiny, huge, negative zero among them.
frames::Frame awkward_frame(const Scene& scene, const frames::Layout& layout, std::int64_t index) {
  ParticleState state;
  state.substep = index * scene.schedule.substeps_per_frame;
  state.position.setRandom(3, particles);
  state.velocity.setRandom(3, particles);
  state.position(0, 0) = 0.1;
  state.position(1, 0) = -0.0;
  state.velocity(2, 1) = 1e-42;
  state.velocity(0, 2) = 3.4e38;
  Fields fields = Fields::unwritten(particles, 0);
  fields.density.setConstant(1000.0 / 3.0);
  fields.pressure.setLinSpaced(particles, -1.0, 1.0);
  frames::Frame frame = frames::make_frame(scene, layout, index, state, fields);
  frame.place.assign(particles, static_cast<std::uint8_t>(Region::receiver));
  return frame;
}

using test::bytes_of;

std::vector<std::vector<std::string>> csv_rows(const std::filesystem::path& file) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

/// float32 dataset as raw values.
std::vector<float> floats_of(const std::filesystem::path& file, const std::string& dataset) {
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t data = H5Dopen2(id, dataset.c_str(), H5P_DEFAULT);
  const hid_t space = H5Dget_space(data);
  std::vector<float> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(data, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Dclose(data);
  H5Fclose(id);
  return values;
}

TEST(FrameFile, GivesBackEveryFloatOfEveryFrame) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  const frames::Frame frame = awkward_frame(scene, layout, 2);
  {
    frames::File file = frames::File::create(folder / "f.h5", scene, layout, {});
    file.write(frame);
  }
  const auto position = floats_of(folder / "f.h5", "/fluid/position");
  const auto velocity = floats_of(folder / "f.h5", "/fluid/velocity");
  const auto pressure = floats_of(folder / "f.h5", "/fluid/pressure");
  const auto wall = floats_of(folder / "f.h5", "/walls/source/vertex");
  ASSERT_EQ(position.size(), 4u * particles * 3);
  for (std::size_t k = 0; k < 3 * particles; ++k) {
    EXPECT_EQ(position[2 * 3 * particles + k], frame.position[k]);
    EXPECT_EQ(velocity[2 * 3 * particles + k], frame.velocity[k]);
  }
  for (std::size_t k = 0; k < particles; ++k) EXPECT_EQ(pressure[2 * particles + k], frame.pressure[k]);
  ASSERT_EQ(wall.size(), 4 * frame.wall.at(0).size());
  EXPECT_EQ(wall[2 * frame.wall[0].size()], frame.wall[0][0]);
}

TEST(FrameFile, TellsWrittenFramesFromUnwrittenOnesByTheirTime) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  frames::File file = frames::File::create(folder / "f.h5", scene, layout, {});
  file.write(awkward_frame(scene, layout, 1));
  const Eigen::VectorXd time = Hdf5Reader(folder / "f.h5").vector("/time", 4);
  EXPECT_TRUE(std::isnan(time[0]));
  EXPECT_EQ(time[1], scene.time_at(scene.schedule.substeps_per_frame));
  EXPECT_TRUE(std::isnan(time[2]));
}

TEST(FrameFile, CallsAFrameWrittenOnlyWhenItIsComplete) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  frames::Frame frame = awkward_frame(scene, layout, 1);
  const auto places = std::exchange(frame.place, {});
  frames::File file = frames::File::create(folder / "f.h5", scene, layout, {});
  file.write_values(frame);
  EXPECT_TRUE(std::isnan(Hdf5Reader(folder / "f.h5").vector("/time", 4)[1]));
  EXPECT_THROW(file.complete(frame), std::runtime_error);
  frame.place = places;
  file.complete(frame);
  EXPECT_EQ(Hdf5Reader(folder / "f.h5").vector("/time", 4)[1], frame.time);
  frames::File::create(folder / "whole.h5", scene, layout, {}).write(frame);
  EXPECT_TRUE(bytes_of(folder / "f.h5") == bytes_of(folder / "whole.h5"));
}

TEST(FrameFile, KeepsASecondPourOut) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  const frames::File file = frames::File::create(folder / "f.h5", scene, layout, {});
  EXPECT_THROW(frames::File::reopen(folder / "f.h5", layout), InputError);
}

TEST(FrameFile, RefusesToContinueFramesOfAnotherShape) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  {
    frames::File::create(folder / "f.h5", scene, frames::layout_of(scene, particles), {});
  }
  try {
    frames::File::reopen(folder / "f.h5", frames::layout_of(scene, particles + 1));
    FAIL() << "must be refused";
  } catch (const InputError& error) {
    EXPECT_EQ(error.key(), "/fluid/position");
    EXPECT_EQ(error.value(), "[4, 7, 3]");
  }
}

TEST(FrameFile, IsTheSameFileForTheSameFrames) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  const frames::Frame frame = awkward_frame(scene, layout, 0);
  for (const char* name : {"a.h5", "b.h5"})
    frames::File::create(folder / name, scene, layout, {{"backend", "hash"}}).write(frame);
  EXPECT_TRUE(bytes_of(folder / "a.h5") == bytes_of(folder / "b.h5"));
}

TEST(FrameFile, TakesAsManyBytesAsForetold) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(40);
  const frames::Layout layout = frames::layout_of(scene, particles);
  {
    frames::File::create(folder / "f.h5", scene, layout, {});
  }
  const auto size = static_cast<std::int64_t>(std::filesystem::file_size(folder / "f.h5"));
  EXPECT_GE(size, frames::file_bytes(layout));
  EXPECT_LE(size, frames::file_bytes(layout) + 20'000);  // HDF5's own structures and the scene
}

TEST(CsvWriter, WritesNumbersThatReadBackAsTheSameFloats) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  const frames::Frame frame = awkward_frame(scene, layout, 2);
  frames::CsvWriter(folder / "csv", scene, layout).write(frame);

  const auto rows = csv_rows(folder / "csv/fluid_000002.csv");
  ASSERT_EQ(rows.size(), 1u + particles);
  EXPECT_EQ(rows[0], (std::vector<std::string>{"id", "x", "y", "z", "vx", "vy", "vz", "density", "pressure"}));
  for (std::size_t i = 0; i < particles; ++i) {
    const auto& row = rows[i + 1];
    ASSERT_EQ(row.size(), 9u);
    EXPECT_EQ(std::stoul(row[0]), i);
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_EQ(std::strtof(row[1 + a].c_str(), nullptr), frame.position[3 * i + a]);
      EXPECT_EQ(std::strtof(row[4 + a].c_str(), nullptr), frame.velocity[3 * i + a]);
    }
    EXPECT_EQ(std::strtof(row[7].c_str(), nullptr), frame.density[i]);
    EXPECT_EQ(std::strtof(row[8].c_str(), nullptr), frame.pressure[i]);
  }
}

/// More than one task formats.
TEST(CsvWriter, WritesManyParticlesInTheirOrder) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const std::size_t n = 10'001;
  frames::Frame frame = awkward_frame(scene, frames::layout_of(scene, particles), 1);
  frame.density.resize(n);
  for (std::size_t i = 0; i < n; ++i) frame.density[i] = static_cast<float>(i);
  for (auto* values : {&frame.position, &frame.velocity}) values->resize(3 * n);
  frame.pressure.resize(n);
  frames::CsvWriter(folder / "csv", scene, frames::layout_of(scene, n)).write(frame);
  const auto rows = csv_rows(folder / "csv/fluid_000001.csv");
  ASSERT_EQ(rows.size(), 1 + n);
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_EQ(rows[1 + i][0], std::to_string(i));
    ASSERT_EQ(rows[1 + i][7], std::to_string(i));
  }
}

TEST(CsvWriter, KeepsMovingAndFixedWallsApartAndCountsTheirIdsThrough) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  frames::CsvWriter(folder / "csv", scene, layout).write(awkward_frame(scene, layout, 1));
  const auto moving = csv_rows(folder / "csv/boundary_000001.csv");
  const auto fixed = csv_rows(folder / "csv/boundary_static.csv");
  const auto source = static_cast<std::size_t>(layout.walls.at(0).surface.vertex.cols());
  const auto receiver = static_cast<std::size_t>(layout.walls.at(1).surface.vertex.cols());
  ASSERT_EQ(moving.size(), 1 + source);
  ASSERT_EQ(fixed.size(), 1 + receiver);
  EXPECT_EQ(moving[1][0], "0");
  EXPECT_EQ(fixed[1][0], std::to_string(source));
  for (const auto& entry : std::filesystem::directory_iterator(folder / "csv"))
    EXPECT_NE(entry.path().extension(), ".partial");
}

/// Every HDF5 reference of an XDMF text: dataset and the dimensions beside it.
std::vector<std::pair<std::string, std::vector<std::int64_t>>> references(const std::string& xdmf) {
  std::vector<std::pair<std::string, std::vector<std::int64_t>>> found;
  const std::regex item(
      "Dimensions=\"([0-9 ]+)\" NumberType=\"[A-Za-z]+\" Precision=\"[0-9]\" "
      "Format=\"HDF\">frames.h5:([^<]+)<");
  for (std::sregex_iterator it(xdmf.begin(), xdmf.end(), item), end; it != end; ++it) {
    std::istringstream dims((*it)[1]);
    found.push_back({(*it)[2], {}});
    for (std::int64_t d; dims >> d;) found.back().second.push_back(d);
  }
  return found;
}

TEST(Xdmf, RefersToDatasetsThatExistWithTheirShapes) {
  const TemporaryFolder folder;
  const Scene scene = test::falling_points_scene(3);
  const frames::Layout layout = frames::layout_of(scene, particles);
  {
    frames::File::create(folder / "frames.h5", scene, layout, {});
  }
  const Hdf5Reader file(folder / "frames.h5");
  const std::vector<double> times = {0, 0.1, 0.2, 0.3};
  const auto fluid = references(frames::fluid_xdmf(layout, times, "frames.h5"));
  const auto walls = references(frames::walls_xdmf(layout, times, "frames.h5"));
  EXPECT_EQ(fluid.size(), 4u * 5);      // frames × (position and four attributes)
  EXPECT_EQ(walls.size(), 4u * 2 * 2);  // frames × containers × (triangles and vertices)
  for (const auto& list : {fluid, walls})
    for (const auto& [dataset, dims] : list) EXPECT_EQ(file.shape(dataset), dims) << dataset;
}

TEST(Xdmf, SelectsEachFrameOnceAndGivesItsTime) {
  const Scene scene = test::falling_points_scene(3);
  const std::string xdmf =
      frames::fluid_xdmf(frames::layout_of(scene, particles), {0, 0.125, 0.25, 0.375}, "frames.h5");
  for (const char* part : {"<Time Value=\"0.125\"/>", "<Time Value=\"0.375\"/>", ">0 0 0 1 1 1 1 7 3<",
                           ">3 0 0 1 1 1 1 7 3<", ">3 0 1 1 1 7<"})
    EXPECT_NE(xdmf.find(part), std::string::npos) << part;
  EXPECT_EQ(xdmf.find(">4 0"), std::string::npos);
}

TEST(Xdmf, StartsEveryHyperSlabWithItsFrame) {
  // ParaView keeps a geometry for as long as the first node inside its DataItem stays the same.
  const Scene scene = test::falling_points_scene(3);
  const std::string xdmf =
      frames::walls_xdmf(frames::layout_of(scene, particles), {0, 0.125, 0.25, 0.375}, "frames.h5");
  std::size_t slabs = 0;
  const std::regex slab("ItemType=\"HyperSlab\" Dimensions=\"[0-9 ]+\"><!-- frame ([0-9]) -->");
  for (std::sregex_iterator it(xdmf.begin(), xdmf.end(), slab), end; it != end; ++it)
    EXPECT_EQ((*it)[1], std::to_string(slabs++));
  EXPECT_EQ(slabs, 4u);  // one moving wall
}

}  // namespace
}  // namespace decant
