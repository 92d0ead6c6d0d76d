/// \file
/// Every array is a hyperslab of a [frame, …] dataset.
#include "tools/frames/xdmf.hpp"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <initializer_list>
#include <sstream>
#include <string_view>
#include <utility>

namespace decant::frames {
namespace {

struct Numbers {
  const char* type;
  int precision;  // bytes
};
constexpr Numbers float32{"Float", 4}, uint8{"UChar", 1}, int32{"Int", 4};

pugi::xml_node child(pugi::xml_node parent, const char* name,
                     std::initializer_list<std::pair<const char*, std::string>> attributes) {
  pugi::xml_node node = parent.append_child(name);
  for (const auto& [key, value] : attributes) node.append_attribute(key).set_value(value.c_str());
  return node;
}

void whole(pugi::xml_node parent, const std::string& dataset, const std::string& shape, Numbers numbers) {
  child(parent, "DataItem",
        {{"Dimensions", shape},
         {"NumberType", numbers.type},
         {"Precision", std::to_string(numbers.precision)},
         {"Format", "HDF"}})
      .text()
      .set(dataset.c_str());
}

/// One frame of a [frames, rows(, columns)] dataset. ParaView's reader keeps a geometry for as long
/// as the first thing inside its DataItem stays the same, so the comment that says which frame it
/// is must come first.
void slab(pugi::xml_node parent, const std::string& dataset, std::size_t frame, std::int64_t frames, std::int64_t rows,
          int columns, Numbers numbers) {
  const bool flat = columns == 1;
  const std::string shape = flat ? fmt::format("{}", rows) : fmt::format("{} {}", rows, columns);
  const std::string selection =
      flat ? fmt::format("{} 0 1 1 1 {}", frame, rows) : fmt::format("{} 0 0 1 1 1 1 {} {}", frame, rows, columns);
  pugi::xml_node item = child(parent, "DataItem", {{"ItemType", "HyperSlab"}, {"Dimensions", shape}});
  item.append_child(pugi::node_comment).set_value(fmt::format(" frame {} ", frame).c_str());
  child(item, "DataItem", {{"Dimensions", flat ? "3 2" : "3 3"}, {"Format", "XML"}}).text().set(selection.c_str());
  whole(item, dataset, fmt::format("{} {}", frames, shape), numbers);
}

/// The grid of all times, in a document of its own.
pugi::xml_node temporal(pugi::xml_document& document, const char* name) {
  document.append_child(pugi::node_declaration).append_attribute("version") = "1.0";
  const pugi::xml_node root = child(document, "Xdmf", {{"Version", "2.0"}});
  return child(child(root, "Domain", {}), "Grid",
               {{"Name", name}, {"GridType", "Collection"}, {"CollectionType", "Temporal"}});
}

/// Without line breaks between elements: ParaView takes them for the first thing in a DataItem.
std::string text_of(const pugi::xml_document& document) {
  std::ostringstream out;
  document.save(out, "", pugi::format_raw);
  return out.str();
}

}  // namespace

std::string fluid_xdmf(const Layout& layout, const std::vector<double>& times, const std::string& data_file) {
  const std::int64_t n = layout.particles;
  pugi::xml_document document;
  const pugi::xml_node all = temporal(document, "fluid");
  for (std::size_t t = 0; t < times.size(); ++t) {
    const pugi::xml_node grid = child(all, "Grid", {{"Name", "fluid"}, {"GridType", "Uniform"}});
    const auto item = [&](pugi::xml_node parent, std::string_view name, int columns, Numbers numbers) {
      slab(parent, fmt::format("{}:/fluid/{}", data_file, name), t, layout.frames, n, columns, numbers);
    };
    const auto attribute = [&](const char* name, const char* type, int columns, Numbers numbers) {
      item(child(grid, "Attribute", {{"Name", name}, {"AttributeType", type}, {"Center", "Node"}}), name, columns,
           numbers);
    };
    child(grid, "Time", {{"Value", fmt::format("{}", times[t])}});
    child(grid, "Topology",
          {{"TopologyType", "Polyvertex"}, {"NumberOfElements", std::to_string(n)}, {"NodesPerElement", "1"}});
    item(child(grid, "Geometry", {{"GeometryType", "XYZ"}}), "position", 3, float32);
    attribute("velocity", "Vector", 3, float32);
    attribute("density", "Scalar", 1, float32);
    attribute("pressure", "Scalar", 1, float32);
    attribute("place", "Scalar", 1, uint8);
  }
  return text_of(document);
}

std::string walls_xdmf(const Layout& layout, const std::vector<double>& times, const std::string& data_file) {
  pugi::xml_document document;
  const pugi::xml_node all = temporal(document, "walls");
  for (std::size_t t = 0; t < times.size(); ++t) {
    const pugi::xml_node together =
        child(all, "Grid", {{"Name", "walls"}, {"GridType", "Collection"}, {"CollectionType", "Spatial"}});
    child(together, "Time", {{"Value", fmt::format("{}", times[t])}});
    for (const RenderWall& wall : layout.walls) {
      const std::string folder = fmt::format("{}:/walls/{}", data_file, wall.name);
      const std::int64_t vertices = wall.surface.vertex.cols();
      const std::size_t triangles = wall.surface.triangle.size();
      const pugi::xml_node grid = child(together, "Grid", {{"Name", wall.name}, {"GridType", "Uniform"}});
      whole(child(grid, "Topology", {{"TopologyType", "Triangle"}, {"NumberOfElements", std::to_string(triangles)}}),
            folder + "/triangle", fmt::format("{} 3", triangles), int32);
      const pugi::xml_node geometry = child(grid, "Geometry", {{"GeometryType", "XYZ"}});
      if (wall.moving) slab(geometry, folder + "/vertex", t, layout.frames, vertices, 3, float32);
      else whole(geometry, folder + "/vertex", fmt::format("{} 3", vertices), float32);
    }
  }
  return text_of(document);
}

}  // namespace decant::frames
