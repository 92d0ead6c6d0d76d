/// \file
/// VTKHDF 2.0, PolyData, not partitioned:
/// https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
#include "oracle/files/vtkhdf.hpp"

namespace decant {
namespace {

IdVector one(std::int64_t value) { return IdVector::Constant(1, value); }

}  // namespace

void begin_vtkhdf(Hdf5Writer& out, const std::string& group, const char* type, std::int64_t minor_version) {
  out.attribute(group, "Version", std::vector<std::int64_t>{2, minor_version});
  out.ascii_attribute(group, "Type", type);
}

void write_vtkhdf_cells(Hdf5Writer& out, const std::string& group, std::int64_t cells, std::int64_t points) {
  out.integers(group + "/NumberOfCells", one(cells));
  out.integers(group + "/NumberOfConnectivityIds", one(cells * points));
  out.integers(group + "/Offsets", IdVector::LinSpaced(cells + 1, 0, cells * points));
}

void write_vtkhdf_vertices(Hdf5Writer& out, const std::string& group, std::int64_t cells) {
  write_vtkhdf_cells(out, group, cells, 1);
  out.integers(group + "/Connectivity", IdVector::LinSpaced(cells, 0, cells - 1));
}

void write_vtkhdf(Hdf5Writer& out, const Neighborhood& points) {
  const std::string group = vtkhdf_root, data = group + "/PointData/";
  const Eigen::Index n = points.position.cols();
  begin_vtkhdf(out, group, "PolyData", 0);
  out.attribute(group, "row", points.row);
  out.attribute(group, "spacing", points.spacing);
  out.attribute(group, "support_radius", points.support_radius);
  out.integers(group + "/NumberOfPoints", one(n));
  out.matrix3(group + "/Points", points.position, "m", {}, Storage::fp32);
  write_vtkhdf_vertices(out, group + "/Vertices", n);
  for (const char* kind : {"/Lines", "/Polygons", "/Strips"}) write_vtkhdf_vertices(out, group + kind, 0);
  out.integers(data + "id", points.id);
  out.bytes(data + "wall", points.wall);
  const auto reals = [&](const char* name, const Eigen::VectorXd& values, const char* unit) {
    out.vector(data + name, values, unit, {}, Storage::fp32);
  };
  reals("density", points.density, "kg/m^3");
  reals("error", points.error, "");
  reals("tolerance", points.tolerance, "");
  reals("score", points.score, "");
}

}  // namespace decant
