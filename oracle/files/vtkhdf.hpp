/// \file
/// VTKHDF, which VTK and ParaView open: what all such files have in common, and a report's points as PolyData, one
/// vertex each.
#pragma once

#include "oracle/files/hdf5_io.hpp"
#include "oracle/report/report.hpp"

#include <cstdint>
#include <string>

namespace decant {

inline const std::string vtkhdf_root = "/VTKHDF";

/// Names a group's type and the version 2.`minor_version` of the format.
void begin_vtkhdf(Hdf5Writer& out, const std::string& group, const char* type, std::int64_t minor_version);

/// Writes `cells` cells of `points` points each; which points, Connectivity, is left to the caller.
void write_vtkhdf_cells(Hdf5Writer& out, const std::string& group, std::int64_t cells, std::int64_t points);
/// The same with Connectivity, where each of the first points is a cell of its own.
void write_vtkhdf_vertices(Hdf5Writer& out, const std::string& group, std::int64_t cells);

/// Writes the group /VTKHDF. Readers of VTK ignore the file's other groups, and the attributes that
/// say which row the points belong to.
void write_vtkhdf(Hdf5Writer& out, const Neighborhood& points);

}  // namespace decant
