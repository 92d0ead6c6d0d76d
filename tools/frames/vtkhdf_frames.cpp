/// \file
/// VTKHDF 2.0, and 2.1 for collections. VTK wants the rows of all steps below one another where frames.h5 has
/// an axis for frames. Both lie in the same order, so a virtual dataset over the whole is enough. What is the
/// same at every step (cells, walls that stand still) is there once, at offset 0 of every step:
/// https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/vtkhdf_specifications.html
#include "tools/frames/vtkhdf_frames.hpp"

#include "oracle/files/hdf5_handle.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "oracle/files/vtkhdf.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <limits>
#include <stdexcept>
#include <utility>

namespace decant::frames {
namespace {

using Shape = std::vector<hsize_t>;

constexpr hsize_t topologies = 4;  // Vertices, Lines, Polygons, Strips

IdVector one(std::int64_t value) { return IdVector::Constant(1, value); }

/// A VTKHDF file in the making, and the frame file that it shows.
class VtkHdf {
 public:
  VtkHdf(const std::filesystem::path& file, const Layout& layout, const std::vector<double>& times,
         std::string data_file)
      : out_(file),
        file_(file),
        times_(Eigen::VectorXd::Map(times.data(), static_cast<Eigen::Index>(times.size()))),
        data_file_(std::move(data_file)) {
    if (times_.size() != layout.frames)
      throw std::runtime_error(fmt::format("{}: {} times of {} frames", file.string(), times_.size(), layout.frames));
    // Virtual datasets came with HDF5 1.10. All else stays in the format that the writer chose.
    if (H5Fset_libver_bounds(out_.id(), H5F_LIBVER_V18, H5F_LIBVER_V110) < 0) fail("file");
  }

  Hdf5Writer& out() { return out_; }
  std::int64_t frames() const { return times_.size(); }

  /// Where each step starts. \param point_offsets  its first point, a step each; \param arrays  of the points
  void steps(const std::string& group, const IdVector& point_offsets, const std::vector<std::string>& arrays) {
    const std::string steps = group + "/Steps";
    out_.attribute(steps, "NSteps", frames());
    out_.vector(steps + "/Values", times_, "s");
    out_.integers(steps + "/NumberOfParts", IdVector::Ones(frames()));
    out_.integers(steps + "/PartOffsets", IdVector::Zero(frames()));
    out_.integers(steps + "/PointOffsets", point_offsets);
    for (const char* name : {"/CellOffsets", "/ConnectivityIdOffsets"})
      zeros(steps + name, {static_cast<hsize_t>(frames()), topologies});
    for (const std::string& name : arrays) out_.integers(steps + "/PointDataOffsets/" + name, point_offsets);
  }

  /// Dataset whose values are all those of a dataset of the frame file, in order. Where that file is missing
  /// HDF5 reads floats as NaN, so that nothing is seen rather than particles at the origin.
  void shown(const std::string& path, hid_t type, const Shape& shape, const std::string& source,
             const Shape& source_shape, const char* unit) {
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
    const Handle here(space_of(shape)), there(space_of(source_shape));
    if (H5Pset_virtual(creation.get(), here.get(), data_file_.c_str(), source.c_str(), there.get()) < 0) fail(path);
    constexpr float missing = std::numeric_limits<float>::quiet_NaN();
    if (H5Tget_class(type) == H5T_FLOAT) H5Pset_fill_value(creation.get(), H5T_NATIVE_FLOAT, &missing);
    create(path, type, shape, creation);
    if (*unit) out_.attribute(path, "unit", unit);
  }

  /// Group whose members VTK takes in the order in which they were made.
  void ordered_group(const std::string& path) {
    const Handle creation(H5Pcreate(H5P_GROUP_CREATE));
    H5Pset_obj_track_times(creation.get(), false);
    H5Pset_link_creation_order(creation.get(), H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    if (!Handle(H5Gcreate2(out_.id(), path.c_str(), H5P_DEFAULT, creation.get(), H5P_DEFAULT))) fail(path);
  }

  void link(const std::string& path, const std::string& target) {
    if (H5Lcreate_soft(target.c_str(), out_.id(), path.c_str(), H5P_DEFAULT, H5P_DEFAULT) < 0) fail(path);
  }

 private:
  /// Never written: 0 is what HDF5 fills with.
  void zeros(const std::string& path, const Shape& shape) {
    create(path, H5T_STD_I64LE, shape, Handle(H5Pcreate(H5P_DATASET_CREATE)));
  }

  void create(const std::string& path, hid_t type, const Shape& shape, const Handle& creation) {
    if (!make_dataset(out_.id(), path, type, shape, creation)) fail(path);
  }

  [[noreturn]] void fail(const std::string& path) const {
    throw std::runtime_error(fmt::format("{}: {}: cannot be written: {}", file_.string(), path, hdf5_message()));
  }

  Hdf5Writer out_;
  std::filesystem::path file_;
  Eigen::VectorXd times_;
  std::string data_file_;
};

void write_wall(VtkHdf& file, const std::string& group, const RenderWall& wall) {
  const std::string source = "/walls/" + wall.name;
  const std::int64_t steps = wall.moving ? file.frames() : 1;
  const auto vertices = static_cast<hsize_t>(wall.surface.vertex.cols());
  const hsize_t rows = static_cast<hsize_t>(steps) * vertices, triangles = wall.surface.triangle.size();
  begin_vtkhdf(file.out(), group, "PolyData", 0);
  file.out().integers(group + "/NumberOfPoints", one(wall.surface.vertex.cols()));
  file.shown(group + "/Points", H5T_IEEE_F32LE, {rows, 3}, source + "/vertex",
             wall.moving ? Shape{static_cast<hsize_t>(steps), vertices, 3} : Shape{vertices, 3}, "m");
  for (const char* kind : {"/Vertices", "/Lines", "/Strips"}) write_vtkhdf_vertices(file.out(), group + kind, 0);
  write_vtkhdf_cells(file.out(), group + "/Polygons", static_cast<std::int64_t>(triangles), 3);
  // In the type of Offsets, which VTK before 9.6 insists on.
  file.shown(group + "/Polygons/Connectivity", H5T_STD_I64LE, {3 * triangles}, source + "/triangle", {triangles, 3},
             "");
  const std::int64_t stride = wall.moving ? wall.surface.vertex.cols() : 0;
  file.steps(group, stride * IdVector::LinSpaced(file.frames(), 0, file.frames() - 1), {});
}

}  // namespace

void write_fluid_vtkhdf(const std::filesystem::path& file, const Layout& layout, const std::vector<double>& times,
                        const std::string& data_file) {
  struct Array {
    const char* name;
    hid_t type;
    bool vector;
    const char* unit;
  };
  const std::vector<Array> arrays = {{"velocity", H5T_IEEE_F32LE, true, "m/s"},
                                     {"density", H5T_IEEE_F32LE, false, "kg/m³"},
                                     {"pressure", H5T_IEEE_F32LE, false, "Pa"},
                                     {"place", H5T_STD_U8LE, false, ""}};
  const std::int64_t n = layout.particles;
  const auto t = static_cast<hsize_t>(layout.frames), particles = static_cast<hsize_t>(n);
  VtkHdf vtk(file, layout, times, data_file);
  const auto shown = [&](const std::string& path, const std::string& source, hid_t type, bool vector,
                         const char* unit) {
    if (vector) vtk.shown(path, type, {t * particles, 3}, source, {t, particles, 3}, unit);
    else vtk.shown(path, type, {t * particles}, source, {t, particles}, unit);
  };
  begin_vtkhdf(vtk.out(), vtkhdf_root, "PolyData", 0);
  vtk.out().integers(vtkhdf_root + "/NumberOfPoints", one(n));
  shown(vtkhdf_root + "/Points", "/fluid/position", H5T_IEEE_F32LE, true, "m");
  write_vtkhdf_vertices(vtk.out(), vtkhdf_root + "/Vertices", n);
  for (const char* kind : {"/Lines", "/Polygons", "/Strips"}) write_vtkhdf_vertices(vtk.out(), vtkhdf_root + kind, 0);
  std::vector<std::string> names;
  for (const Array& array : arrays) {
    const std::string name = array.name;
    shown(vtkhdf_root + "/PointData/" + name, "/fluid/" + name, array.type, array.vector, array.unit);
    names.push_back(name);
  }
  vtk.steps(vtkhdf_root, n * IdVector::LinSpaced(layout.frames, 0, layout.frames - 1), names);
  vtk.out().commit();
}

void write_walls_vtkhdf(const std::filesystem::path& file, const Layout& layout, const std::vector<double>& times,
                        const std::string& data_file) {
  VtkHdf vtk(file, layout, times, data_file);
  vtk.ordered_group(vtkhdf_root);
  begin_vtkhdf(vtk.out(), vtkhdf_root, "PartitionedDataSetCollection", 1);
  vtk.ordered_group(vtkhdf_root + "/Assembly");
  for (std::size_t w = 0; w < layout.walls.size(); ++w) {
    // VTK's assembly takes no name that begins with a digit, and the collection has members of its own.
    const std::string name = "wall_" + layout.walls[w].name, group = vtkhdf_root + "/" + name;
    write_wall(vtk, group, layout.walls[w]);
    vtk.out().attribute(group, "Index", static_cast<std::int64_t>(w));
    vtk.ordered_group(vtkhdf_root + "/Assembly/" + name);
    vtk.link(vtkhdf_root + "/Assembly/" + name + "/" + name, group);
  }
  vtk.out().commit();
}

}  // namespace decant::frames
