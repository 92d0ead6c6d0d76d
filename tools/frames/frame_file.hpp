/// \file
/// frames.h5 as it lies on the disk: every dataset is laid out and allocated before the first
/// frame, and frames are then written straight to their place. HDF5's own metadata never changes
/// after that, so a kill at any moment leaves a file that every HDF5 reader opens; and because no
/// HDF5 call is made while pouring, a writer thread needs no thread-safe HDF5 library.
#pragma once

#include "reference/sampling.hpp"
#include "reference/scene.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace decant::frames {

/// A container's render boundary, and whether its vertices differ from frame to frame.
struct RenderWall {
  std::string name;
  bool moving = false;
  RenderSurface surface;  // container frame
};

/// What a frame file holds: sizes fixed before the first frame.
struct Layout {
  std::int64_t particles = 0;
  std::int64_t frames = 0;  // the initial one included
  std::vector<RenderWall> walls;
};

/// Layout of the scene's frames, render boundaries with vertices about dx apart.
Layout layout_of(const Scene& scene, std::int64_t particles);

/// One frame as it is written; positions and velocities by particle, x y z.
struct Frame {
  std::int64_t index = 0;
  double time = 0;                        // s
  std::vector<float> position, velocity;  // 3N, m and m/s
  std::vector<float> density, pressure;   // N, kg/m³ and Pa
  std::vector<std::uint8_t> place;        // N, decant::Region
  std::vector<std::vector<float>> wall;   // a moving wall each, in the layout's order: 3V, m, world
};

/// World coordinates of a surface's vertices, x y z by vertex. \param time  s
std::vector<float> posed_vertices(const Container& container, const RenderSurface& surface, double time);

/// Bytes that the frame file of a layout takes, the datasets alone.
std::int64_t file_bytes(const Layout& layout);

/// The open frame file. Not thread-safe; any one thread may write.
class File {
 public:
  /// Creates the file with all datasets, reserves its room on the disk, marks all frames unwritten
  /// (time NaN) and writes the walls that stand still. `texts` become attributes of the root.
  /// Throws std::runtime_error naming the file.
  static File create(const std::filesystem::path& file, const Scene& scene, const Layout& layout,
                     const std::map<std::string, std::string>& texts);
  /// Opens a file left unfinished. Throws InputError where its datasets do not fit the layout.
  static File reopen(const std::filesystem::path& file, const Layout& layout);

  File(File&& other) noexcept;
  File& operator=(File&&) = delete;
  ~File();

  /// Writes one frame, its time last. Throws std::runtime_error where the disk refuses.
  void write(const Frame& frame);
  /// The same in two parts: all but places and time, for which the places need not be known; and these two, which
  /// make the frame complete.
  void write_values(const Frame& frame);
  void complete(const Frame& frame);
  /// Hands everything written to the disk. Throws std::runtime_error where it refuses.
  void sync();

 private:
  File(std::filesystem::path file, const Layout& layout);
  void put(std::uint64_t dataset_offset, const void* data, std::size_t bytes, std::int64_t row);
  template <class T>
  void put_row(const std::string& path, const std::vector<T>& values, std::int64_t row);
  void require(bool fits, const Frame& frame) const;

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::int64_t particles_, frames_;
  std::map<std::string, std::uint64_t> offset_;  // of a dataset's first byte in the file
  std::vector<std::string> moving_;              // dataset paths of the moving walls
};

}  // namespace decant::frames
