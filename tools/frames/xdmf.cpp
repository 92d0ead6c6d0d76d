/// \file
/// Every array is a hyperslab of a [frame, …] dataset.
#include "tools/frames/xdmf.hpp"

#include <fmt/format.h>

#include <iterator>
#include <string_view>

namespace decant {
namespace {

constexpr std::string_view head =
    "<?xml version=\"1.0\"?>\n"
    "<Xdmf Version=\"2.0\">\n"
    "<Domain>\n";
constexpr std::string_view tail = "</Grid>\n</Domain>\n</Xdmf>\n";

struct Numbers {
  std::string_view type;
  int precision;  // bytes
};
constexpr Numbers float32{"Float", 4}, uint8{"UChar", 1}, int32{"Int", 4};

std::string whole(const std::string& dataset, const std::string& shape, Numbers numbers) {
  return fmt::format("<DataItem Dimensions=\"{}\" NumberType=\"{}\" Precision=\"{}\" Format=\"HDF\">{}</DataItem>",
                     shape, numbers.type, numbers.precision, dataset);
}

/// One frame of a [frames, rows(, columns)] dataset. ParaView's reader keeps a geometry for as long
/// as the first thing inside its DataItem stays the same, so the comment that says which frame it
/// is must come first.
std::string slab(const std::string& dataset, std::size_t frame, std::int64_t frames, std::int64_t rows, int columns,
                 Numbers numbers) {
  const bool flat = columns == 1;
  const std::string shape = flat ? fmt::format("{}", rows) : fmt::format("{} {}", rows, columns);
  const std::string selection =
      flat ? fmt::format("{} 0 1 1 1 {}", frame, rows) : fmt::format("{} 0 0 1 1 1 1 {} {}", frame, rows, columns);
  return fmt::format(
      "<DataItem ItemType=\"HyperSlab\" Dimensions=\"{}\"><!-- frame {} -->"
      "<DataItem Dimensions=\"3 {}\" Format=\"XML\">{}</DataItem>{}</DataItem>",
      shape, frame, flat ? 2 : 3, selection, whole(dataset, fmt::format("{} {}", frames, shape), numbers));
}

std::string temporal(std::string_view name) {
  return fmt::format("<Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n", name);
}

std::string attribute(std::string_view name, std::string_view type, const std::string& item) {
  return fmt::format("<Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"Node\">{}</Attribute>\n", name, type, item);
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

}  // namespace

std::string frames_xdmf(const FrameLayout& layout, const std::vector<double>& times, const std::string& data_file) {
  const std::int64_t n = layout.particles;
  std::string out = std::string(head) + temporal("fluid");
  for (std::size_t t = 0; t < times.size(); ++t) {
    const auto item = [&](std::string_view name, int columns, Numbers numbers) {
      return slab(fmt::format("{}:/fluid/{}", data_file, name), t, layout.frames, n, columns, numbers);
    };
    out += fmt::format(
        "<Grid Name=\"fluid\" GridType=\"Uniform\"><Time Value=\"{}\"/>\n"
        "<Topology TopologyType=\"Polyvertex\" NumberOfElements=\"{}\" NodesPerElement=\"1\"/>\n"
        "<Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
        times[t], n, item("position", 3, float32));
    out += attribute("velocity", "Vector", item("velocity", 3, float32));
    out += attribute("density", "Scalar", item("density", 1, float32));
    out += attribute("pressure", "Scalar", item("pressure", 1, float32));
    out += attribute("place", "Scalar", item("place", 1, uint8));
    out += "</Grid>\n";
  }
  return out + std::string(tail);
}

std::string walls_xdmf(const FrameLayout& layout, const std::vector<double>& times, const std::string& data_file) {
  std::string out = std::string(head) + temporal("walls");
  for (std::size_t t = 0; t < times.size(); ++t) {
    out += fmt::format(
        "<Grid Name=\"walls\" GridType=\"Collection\" CollectionType=\"Spatial\">"
        "<Time Value=\"{}\"/>\n",
        times[t]);
    for (const RenderWall& wall : layout.walls) {
      const std::string name = escaped(wall.name);
      const std::string folder = fmt::format("{}:/walls/{}", data_file, name);
      const std::int64_t vertices = wall.surface.vertex.cols();
      const std::size_t triangles = wall.surface.triangle.size();
      out += fmt::format(
          "<Grid Name=\"{}\" GridType=\"Uniform\">\n"
          "<Topology TopologyType=\"Triangle\" NumberOfElements=\"{}\">{}</Topology>\n"
          "<Geometry GeometryType=\"XYZ\">{}</Geometry>\n</Grid>\n",
          name, triangles, whole(folder + "/triangle", fmt::format("{} 3", triangles), int32),
          wall.moving ? slab(folder + "/vertex", t, layout.frames, vertices, 3, float32)
                      : whole(folder + "/vertex", fmt::format("{} 3", vertices), float32));
    }
    out += "</Grid>\n";
  }
  return out + std::string(tail);
}

}  // namespace decant
