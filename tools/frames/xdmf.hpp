/// \file
/// The XDMF files that let ParaView open frames.h5. They hold no data, only where it lies.
#pragma once

#include "tools/frames/frame_file.hpp"

#include <string>
#include <vector>

namespace decant::frames {

/// Temporal collection of point clouds: one step a frame, with velocity, density, pressure, place.
/// \param times  s, a frame each; \param data_file  name of the HDF5 file as seen from the XDMF
/// file
std::string fluid_xdmf(const Layout& layout, const std::vector<double>& times, const std::string& data_file);

/// Temporal collection of the walls' triangles: the moving ones by frame, the others always the
/// same.
std::string walls_xdmf(const Layout& layout, const std::vector<double>& times, const std::string& data_file);

}  // namespace decant::frames
