/// \file
/// Points in the form that ParaView opens: VTKHDF's PolyData, one vertex a point.
#pragma once

#include "oracle/files/hdf5_io.hpp"
#include "oracle/report/report.hpp"

namespace decant {

/// Writes the group /VTKHDF. Readers of VTK ignore the file's other groups, and the attributes that
/// say which row the points belong to.
void write_vtkhdf(Hdf5Writer& out, const Neighborhood& points);

}  // namespace decant
