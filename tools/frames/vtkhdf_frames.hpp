/// \file
/// The VTKHDF files that let VTK and ParaView open frames.h5. Like the XDMF files they hold no frames, only
/// where these lie: HDF5 reads through them into frames.h5.
#pragma once

#include "tools/frames/frame_file.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace decant::frames {

/// Temporal PolyData: one step a frame, one vertex a particle, with velocity, density, pressure, place.
/// \param times  s, one for each of the layout's frames; \param data_file  name of the frame file, which
/// must lie in the same folder and need not exist yet. Throws std::runtime_error naming the file where it
/// cannot be written, or where the times are not as many as the frames.
void write_fluid_vtkhdf(const std::filesystem::path& file, const Layout& layout, const std::vector<double>& times,
                        const std::string& data_file);

/// Temporal PartitionedDataSetCollection: a PolyData of triangles for each wall, `wall_` before its name; the
/// moving ones by frame, the others always the same. Parameters and errors as above.
void write_walls_vtkhdf(const std::filesystem::path& file, const Layout& layout, const std::vector<double>& times,
                        const std::string& data_file);

}  // namespace decant::frames
