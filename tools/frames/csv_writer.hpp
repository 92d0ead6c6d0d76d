/// \file
/// Frames as text, one file each, the way the published study wrote them. Every number is the
/// shortest decimal that reads back as the same float.
#pragma once

#include "tools/frames/frame_file.hpp"

#include <filesystem>

namespace decant::frames {

/// Writes DIR/fluid_000123.csv (id,x,y,z,vx,vy,vz,density,pressure; m, m/s, kg/m³, Pa),
/// DIR/boundary_000123.csv (id,x,y,z of the moving walls' render boundary) and once
/// DIR/boundary_static.csv (of the others). Ids of boundary points count through all walls. Each
/// file is written aside and renamed.
class CsvWriter {
 public:
  /// Makes the folder and writes the walls that stand still. Throws std::runtime_error naming the
  /// file where writing fails.
  CsvWriter(std::filesystem::path folder, const Scene& scene, const Layout& layout);
  /// Throws std::runtime_error naming the file where writing fails.
  void write(const Frame& frame) const;

 private:
  std::filesystem::path folder_;
  std::vector<std::int64_t> first_id_;  // of each moving wall
};

/// Bytes to expect of a layout's CSV files.
std::int64_t csv_bytes(const Layout& layout);

}  // namespace decant::frames
