/// \file
/// VTKHDF 2.0, PolyData, not partitioned:
/// https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
#include "oracle/files/vtkhdf.hpp"

#include <string>

namespace decant {
namespace {

constexpr const char* root = "/VTKHDF";

IdVector one(std::int64_t value) { return IdVector::Constant(1, value); }

/// `cells` cells of one point each.
void write_cells(Hdf5Writer& out, const std::string& kind, std::int64_t cells) {
  const std::string group = std::string(root) + "/" + kind;
  out.integers(group + "/NumberOfCells", one(cells));
  out.integers(group + "/NumberOfConnectivityIds", one(cells));
  out.integers(group + "/Connectivity", IdVector::LinSpaced(cells, 0, cells - 1));
  out.integers(group + "/Offsets", IdVector::LinSpaced(cells + 1, 0, cells));
}

}  // namespace

void write_vtkhdf(Hdf5Writer& out, const Neighborhood& points) {
  const std::string group = root, data = group + "/PointData/";
  const Eigen::Index n = points.position.cols();
  out.attribute(group, "Version", std::vector<std::int64_t>{2, 0});
  out.ascii_attribute(group, "Type", "PolyData");
  out.attribute(group, "row", points.row);
  out.attribute(group, "spacing", points.spacing);
  out.attribute(group, "support_radius", points.support_radius);
  out.integers(group + "/NumberOfPoints", one(n));
  out.matrix3(group + "/Points", points.position, "m", {}, Storage::fp32);
  write_cells(out, "Vertices", n);
  for (const char* kind : {"Lines", "Polygons", "Strips"}) write_cells(out, kind, 0);
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
