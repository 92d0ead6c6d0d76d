/// \file
/// Formats frames as CSV.
#include "tools/frames/csv_writer.hpp"

#include "oracle/files/file_aside.hpp"
#include "reference/pose.hpp"

#include <fmt/compile.h>
#include <fmt/format.h>

#include <iterator>

namespace decant {
namespace {

// Measured on poured frames; only the disk estimate depends on them.
constexpr std::int64_t bytes_per_particle = 100, bytes_per_vertex = 40;

void append_points(fmt::memory_buffer& out, std::int64_t first_id, const std::vector<float>& xyz) {
  for (std::size_t p = 0; 3 * p < xyz.size(); ++p)
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{},{},{},{}\n"), first_id + static_cast<std::int64_t>(p),
                   xyz[3 * p], xyz[3 * p + 1], xyz[3 * p + 2]);
}

void append_text(fmt::memory_buffer& out, std::string_view text) { out.append(text.data(), text.data() + text.size()); }

}  // namespace

CsvWriter::CsvWriter(std::filesystem::path folder, const Scene& scene, const FrameLayout& layout)
    : folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
  fmt::memory_buffer text;
  append_text(text, "id,x,y,z\n");
  std::int64_t id = 0;
  for (std::size_t c = 0; c < layout.walls.size(); ++c) {
    const RenderWall& wall = layout.walls[c];
    if (wall.moving) first_id_.push_back(id);
    else append_points(text, id, posed_vertices(scene.containers.at(c), wall.surface, 0.0));
    id += wall.surface.vertex.cols();
  }
  write_text_file(folder_ / "boundary_static.csv", {text.data(), text.size()});
}

void CsvWriter::write(const Frame& frame) const {
  fmt::memory_buffer text;
  append_text(text, "id,x,y,z,vx,vy,vz,density,pressure\n");
  for (std::size_t i = 0; i < frame.density.size(); ++i) {
    const float* x = &frame.position[3 * i];
    const float* v = &frame.velocity[3 * i];
    fmt::format_to(std::back_inserter(text), FMT_COMPILE("{},{},{},{},{},{},{},{},{}\n"), i, x[0], x[1], x[2], v[0],
                   v[1], v[2], frame.density[i], frame.pressure[i]);
  }
  write_text_file(folder_ / fmt::format("fluid_{:06}.csv", frame.index), {text.data(), text.size()});
  if (first_id_.empty()) return;
  text.clear();
  append_text(text, "id,x,y,z\n");
  for (std::size_t w = 0; w < first_id_.size(); ++w) append_points(text, first_id_[w], frame.wall.at(w));
  write_text_file(folder_ / fmt::format("boundary_{:06}.csv", frame.index), {text.data(), text.size()});
}

std::int64_t csv_bytes(const FrameLayout& layout) {
  std::int64_t bytes = layout.frames * layout.particles * bytes_per_particle;
  for (const RenderWall& wall : layout.walls)
    bytes += (wall.moving ? layout.frames : 1) * wall.surface.vertex.cols() * bytes_per_vertex;
  return bytes;
}

}  // namespace decant
