/// \file
/// Formats frames as CSV.
#include "tools/frames/csv_writer.hpp"

#include "oracle/files/file_aside.hpp"
#include "reference/pose.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace decant::frames {
namespace {

// Measured on poured frames; only the disk estimate depends on them.
constexpr std::int64_t bytes_per_particle = 100, bytes_per_vertex = 40;

// Lines that one task formats.
constexpr std::size_t lines_per_chunk = 4096;

using Chunks = std::vector<fmt::memory_buffer>;

/// Lines 0 … count − 1, formatted in parallel. \param append  adds one to a buffer
template <class Append>
Chunks lines(std::size_t count, Append append) {
  Chunks chunks((count + lines_per_chunk - 1) / lines_per_chunk);
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
    for (std::size_t k = c * lines_per_chunk; k < std::min(count, (c + 1) * lines_per_chunk); ++k) append(chunks[c], k);
  });
  return chunks;
}

Chunks points(std::int64_t first_id, const std::vector<float>& xyz) {
  return lines(xyz.size() / 3, [&](fmt::memory_buffer& out, std::size_t p) {
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},{},{},{}\n"), first_id + static_cast<std::int64_t>(p),
                   xyz[3 * p], xyz[3 * p + 1], xyz[3 * p + 2]);
  });
}

void put(FileAside& out, const Chunks& chunks) {
  for (const fmt::memory_buffer& chunk : chunks) out.write({chunk.data(), chunk.size()});
}

}  // namespace

CsvWriter::CsvWriter(std::filesystem::path folder, const Scene& scene, const Layout& layout)
    : folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
  FileAside out(folder_ / "boundary_static.csv");
  out.write("id,x,y,z\n");
  std::int64_t id = 0;
  for (std::size_t c = 0; c < layout.walls.size(); ++c) {
    const RenderWall& wall = layout.walls[c];
    if (wall.moving) first_id_.push_back(id);
    else put(out, points(id, posed_vertices(scene.containers.at(c), wall.surface, 0.0)));
    id += wall.surface.vertex.cols();
  }
  out.commit();
}

void CsvWriter::write(const Frame& frame) const {
  FileAside fluid(folder_ / fmt::format("fluid_{:06}.csv", frame.index));
  fluid.write("id,x,y,z,vx,vy,vz,density,pressure\n");
  put(fluid, lines(frame.density.size(), [&](fmt::memory_buffer& out, std::size_t i) {
        const float* x = &frame.position[3 * i];
        const float* v = &frame.velocity[3 * i];
        fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},{},{},{},{},{},{},{},{}\n"), i, x[0], x[1], x[2], v[0],
                       v[1], v[2], frame.density[i], frame.pressure[i]);
      }));
  fluid.commit();
  if (first_id_.empty()) return;
  FileAside walls(folder_ / fmt::format("boundary_{:06}.csv", frame.index));
  walls.write("id,x,y,z\n");
  for (std::size_t w = 0; w < first_id_.size(); ++w) put(walls, points(first_id_[w], frame.wall.at(w)));
  walls.commit();
}

std::int64_t csv_bytes(const Layout& layout) {
  std::int64_t bytes = layout.frames * layout.particles * bytes_per_particle;
  for (const RenderWall& wall : layout.walls)
    bytes += (wall.moving ? layout.frames : 1) * wall.surface.vertex.cols() * bytes_per_vertex;
  return bytes;
}

}  // namespace decant::frames
