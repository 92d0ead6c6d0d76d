/// \file
/// What HDF5 reads from the VTKHDF files: every frame of frames.h5, bit for bit, wherever the folder lies.
#include "tools/frames/vtkhdf_frames.hpp"

#include "oracle/files/hdf5_handle.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tests/falling_points.hpp"
#include "tests/file_bytes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <numeric>
#include <sstream>

namespace decant {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t particles = 7, frames = 4;

/// What a file says of a dataset, and all its bytes as they would lie in memory.
struct Dataset {
  std::vector<hsize_t> shape;
  std::size_t value_size = 0;
  bool is_virtual = false;
  std::vector<char> bytes;

  template <class T>
  std::vector<T> as() const {
    EXPECT_EQ(value_size, sizeof(T));
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
};

/// As any other program reads it, in the type of the file.
Dataset dataset_of(const fs::path& file, const std::string& path) {
  Dataset out;
  const Handle id(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  const Handle data(H5Dopen2(id.get(), path.c_str(), H5P_DEFAULT));
  EXPECT_TRUE(data) << path;
  if (!data) return out;
  const Handle space(H5Dget_space(data.get())), type(H5Dget_type(data.get())),
      creation(H5Dget_create_plist(data.get()));
  out.shape.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space.get())));
  H5Sget_simple_extent_dims(space.get(), out.shape.data(), nullptr);
  out.value_size = H5Tget_size(type.get());
  out.is_virtual = H5Pget_layout(creation.get()) == H5D_VIRTUAL;
  out.bytes.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get())) * out.value_size);
  if (out.bytes.empty()) return out;
  EXPECT_GE(H5Dread(data.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, out.bytes.data()), 0) << path;
  return out;
}

std::vector<std::int64_t> integers_of(const fs::path& file, const std::string& path) {
  return dataset_of(file, path).as<std::int64_t>();
}

std::vector<double> some_times() { return {0.0, 0.1, 0.2, 0.30000000000000004}; }

/// A pour's frame file of numbers that are all different, and what describes it.
frames::Layout write_frames(const fs::path& folder, std::int64_t n = particles) {
  const Scene scene = test::falling_points_scene(frames - 1);
  const frames::Layout layout = frames::layout_of(scene, n);
  frames::File file = frames::File::create(folder / "frames.h5", scene, layout, {});
  float next = 1.0f;
  const auto fill = [&](std::vector<float>& values, std::int64_t size) {
    values.resize(static_cast<std::size_t>(size));
    for (float& value : values) value = next += 0.1f;
  };
  for (std::int64_t t = 0; t < frames; ++t) {
    frames::Frame frame;
    frame.index = t;
    frame.time = some_times()[static_cast<std::size_t>(t)];
    fill(frame.position, 3 * n);
    fill(frame.velocity, 3 * n);
    fill(frame.density, n);
    fill(frame.pressure, n);
    for (std::int64_t i = 0; i < n; ++i) frame.place.push_back(static_cast<std::uint8_t>((t + i) % 5));
    for (const frames::RenderWall& wall : layout.walls)
      if (wall.moving) fill(frame.wall.emplace_back(), 3 * wall.surface.vertex.cols());
    file.write(frame);
  }
  frames::write_fluid_vtkhdf(folder / "frames.vtkhdf", layout, some_times(), "frames.h5");
  frames::write_walls_vtkhdf(folder / "walls.vtkhdf", layout, some_times(), "frames.h5");
  return layout;
}

using test::bytes_of;

const std::vector<std::pair<std::string, std::string>> shown_arrays = {
    {"/VTKHDF/Points", "/fluid/position"},
    {"/VTKHDF/PointData/velocity", "/fluid/velocity"},
    {"/VTKHDF/PointData/density", "/fluid/density"},
    {"/VTKHDF/PointData/pressure", "/fluid/pressure"},
    {"/VTKHDF/PointData/place", "/fluid/place"}};

TEST(FramesVtkHdf, ShowsEveryValueOfEveryFrameInTheTypeItHas) {
  const TemporaryFolder folder;
  write_frames(folder / "");
  for (const auto& [path, source] : shown_arrays) {
    const Dataset shown = dataset_of(folder / "frames.vtkhdf", path);
    const Dataset frame_data = dataset_of(folder / "frames.h5", source);
    EXPECT_TRUE(shown.is_virtual) << path;
    EXPECT_EQ(shown.value_size, frame_data.value_size) << path;
    EXPECT_TRUE(shown.bytes == frame_data.bytes) << path;
    std::vector<hsize_t> flat = {frames * particles};
    if (frame_data.shape.size() == 3) flat.push_back(3);
    EXPECT_EQ(shown.shape, flat) << path;
  }
}

TEST(FramesVtkHdf, StartsEachStepAtItsFrame) {
  const TemporaryFolder folder;
  write_frames(folder / "");
  const fs::path file = folder / "frames.vtkhdf";
  const std::string steps = "/VTKHDF/Steps/";
  EXPECT_EQ(Hdf5Reader(file).integer_attribute("/VTKHDF/Steps", "NSteps"), frames);
  EXPECT_EQ(dataset_of(file, steps + "Values").as<double>(), some_times());
  const std::vector<std::int64_t> starts = {0, 7, 14, 21}, zeros(frames, 0), ones(frames, 1);
  EXPECT_EQ(integers_of(file, steps + "PointOffsets"), starts);
  for (const char* name : {"velocity", "density", "pressure", "place"})
    EXPECT_EQ(integers_of(file, steps + "PointDataOffsets/" + name), starts) << name;
  EXPECT_EQ(integers_of(file, steps + "PartOffsets"), zeros);
  EXPECT_EQ(integers_of(file, steps + "NumberOfParts"), ones);
  for (const char* name : {"CellOffsets", "ConnectivityIdOffsets"}) {
    EXPECT_EQ(dataset_of(file, steps + name).shape, (std::vector<hsize_t>{frames, 4})) << name;
    EXPECT_EQ(integers_of(file, steps + name), std::vector<std::int64_t>(4 * frames, 0)) << name;
  }
}

TEST(FramesVtkHdf, HasOneVertexAParticleAndNoOtherCells) {
  const TemporaryFolder folder;
  write_frames(folder / "");
  const fs::path file = folder / "frames.vtkhdf";
  std::vector<std::int64_t> offsets(particles + 1);
  std::iota(offsets.begin(), offsets.end(), 0);
  EXPECT_EQ(integers_of(file, "/VTKHDF/NumberOfPoints"), std::vector{particles});
  EXPECT_EQ(integers_of(file, "/VTKHDF/Vertices/NumberOfCells"), std::vector{particles});
  EXPECT_EQ(integers_of(file, "/VTKHDF/Vertices/NumberOfConnectivityIds"), std::vector{particles});
  EXPECT_EQ(integers_of(file, "/VTKHDF/Vertices/Offsets"), offsets);
  offsets.pop_back();
  EXPECT_EQ(integers_of(file, "/VTKHDF/Vertices/Connectivity"), offsets);
  for (const std::string kind : {"Lines", "Polygons", "Strips"}) {
    EXPECT_EQ(integers_of(file, "/VTKHDF/" + kind + "/NumberOfCells"), std::vector<std::int64_t>{0});
    EXPECT_EQ(integers_of(file, "/VTKHDF/" + kind + "/Offsets"), std::vector<std::int64_t>{0});
    EXPECT_EQ(integers_of(file, "/VTKHDF/" + kind + "/Connectivity"), std::vector<std::int64_t>{});
  }
}

TEST(FramesVtkHdf, HoldsNoFrames) {
  const TemporaryFolder folder;
  write_frames(folder / "", 20'000);
  EXPECT_LT(fs::file_size(folder / "frames.vtkhdf"), fs::file_size(folder / "frames.h5") / 10);
  EXPECT_LT(fs::file_size(folder / "walls.vtkhdf"), fs::file_size(folder / "frames.h5") / 10);
}

TEST(FramesVtkHdf, GoesWithItsFolder) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "here");
  write_frames(folder / "here");
  const auto before = dataset_of(folder / "here/frames.vtkhdf", "/VTKHDF/Points").bytes;
  fs::rename(folder / "here", folder / "there");
  EXPECT_TRUE(dataset_of(folder / "there/frames.vtkhdf", "/VTKHDF/Points").bytes == before);
}

TEST(FramesVtkHdf, ShowsNothingWithoutItsFrames) {
  const TemporaryFolder folder;
  write_frames(folder / "");
  fs::remove(folder / "frames.h5");
  for (const float x : dataset_of(folder / "frames.vtkhdf", "/VTKHDF/Points").as<float>()) EXPECT_TRUE(std::isnan(x));
}

TEST(FramesVtkHdf, IsTheSameFileForTheSameFrames) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) {
    fs::create_directory(folder / name);
    write_frames(folder / name);
  }
  for (const char* file : {"frames.vtkhdf", "walls.vtkhdf"})
    EXPECT_TRUE(bytes_of(folder / "a" / file) == bytes_of(folder / "b" / file)) << file;
}

TEST(FramesVtkHdf, IsWrittenForAPourWithoutParticles) {
  const TemporaryFolder folder;
  write_frames(folder / "", 0);
  const fs::path file = folder / "frames.vtkhdf";
  EXPECT_EQ(dataset_of(file, "/VTKHDF/Points").shape, (std::vector<hsize_t>{0, 3}));
  EXPECT_EQ(integers_of(file, "/VTKHDF/Vertices/Offsets"), std::vector<std::int64_t>{0});
}

TEST(FramesVtkHdf, IsRefusedWhereTimesAreMissing) {
  const TemporaryFolder folder;
  const frames::Layout layout = frames::layout_of(test::falling_points_scene(frames - 1), particles);
  EXPECT_THROW(frames::write_fluid_vtkhdf(folder / "f.vtkhdf", layout, {0.0}, "frames.h5"), std::runtime_error);
  EXPECT_TRUE(fs::is_empty(folder / ""));
}

TEST(WallsVtkHdf, ShowsTheTrianglesOfEveryWallAndEveryFrameOfTheMovingOnes) {
  const TemporaryFolder folder;
  const frames::Layout layout = write_frames(folder / "");
  const fs::path file = folder / "walls.vtkhdf";
  ASSERT_EQ(layout.walls.size(), 2u);
  for (std::size_t w = 0; w < layout.walls.size(); ++w) {
    const frames::RenderWall& wall = layout.walls[w];
    const std::string group = "/VTKHDF/wall_" + wall.name, source = "/walls/" + wall.name;
    EXPECT_EQ(wall.moving, w == 0);
    EXPECT_EQ(Hdf5Reader(file).integer_attribute(group, "Index"), static_cast<std::int64_t>(w));
    EXPECT_TRUE(dataset_of(file, group + "/Points").bytes ==
                dataset_of(folder / "frames.h5", source + "/vertex").bytes);
    const auto triangle = dataset_of(folder / "frames.h5", source + "/triangle").as<std::int32_t>();
    const std::vector<std::int64_t> wide(triangle.begin(), triangle.end());
    EXPECT_TRUE(integers_of(file, group + "/Polygons/Connectivity") == wide);
    const auto cells = static_cast<std::int64_t>(wall.surface.triangle.size());
    EXPECT_EQ(integers_of(file, group + "/Polygons/NumberOfCells"), std::vector{cells});
    EXPECT_EQ(integers_of(file, group + "/Polygons/Offsets").back(), 3 * cells);
    const std::int64_t v = wall.moving ? wall.surface.vertex.cols() : 0;
    EXPECT_EQ(integers_of(file, group + "/Steps/PointOffsets"), (std::vector<std::int64_t>{0, v, 2 * v, 3 * v}));
    EXPECT_EQ(integers_of(file, "/VTKHDF/Assembly/wall_" + wall.name + "/wall_" + wall.name + "/NumberOfPoints"),
              std::vector<std::int64_t>{wall.surface.vertex.cols()});
  }
}

}  // namespace
}  // namespace decant
