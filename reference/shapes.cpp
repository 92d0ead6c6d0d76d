/// \file
/// Cups as outlines, tanks as slabs, and the surface either one shows.
#include "reference/shapes.hpp"

#include <algorithm>

namespace decant {

RevolvedShape cup_shape(double inner_radius, double inner_height, double wall_thickness) {
  const double outer = inner_radius + wall_thickness;
  return {{{0.0, -wall_thickness},
           {outer, -wall_thickness},
           {outer, inner_height},
           {inner_radius, inner_height},
           {inner_radius, 0.0},
           {0.0, 0.0}}};
}

BoxShape tank_shape(const Vec3& size, double wall_thickness, const OpenFaces& open) {
  BoxShape tank;
  tank.cavity = {Vec3::Zero(), size};
  Vec3 low = Vec3::Zero(), high = size;
  for (int a = 0; a < 3; ++a) {
    if (!open[a][0]) low[a] -= wall_thickness;
    if (!open[a][1]) high[a] += wall_thickness;
  }
  for (int a = 0; a < 3; ++a)
    for (int side = 0; side < 2; ++side) {
      if (open[a][side]) continue;
      SolidBox slab{low, high};
      (side == 0 ? slab.max : slab.min)[a] = side == 0 ? 0.0 : size[a];
      tank.solid.push_back(slab);
    }
  return tank;
}

bool in_solid(const std::vector<SolidBox>& solid, const Vec3& local) {
  return std::any_of(solid.begin(), solid.end(), [&](const SolidBox& box) {
    return (local.array() >= box.min.array()).all() && (local.array() <= box.max.array()).all();
  });
}

int crossings_outward(const std::vector<ProfileEdge>& edges, double r, double z) {
  int count = 0;
  for (const auto& e : edges) {
    if ((e.z0 > z) == (e.z1 > z)) continue;
    if (r < e.r0 + (z - e.z0) / (e.z1 - e.z0) * (e.r1 - e.r0)) ++count;
  }
  return count;
}

std::vector<BoxFace> exposed_faces(const BoxShape& shape) {
  // Every coordinate at which a box begins or ends cuts space into cells that are solid or not;
  // the surface is where a solid cell meets one that is not.
  std::array<std::vector<double>, 3> cut;
  for (const auto& box : shape.solid)
    for (int a = 0; a < 3; ++a) {
      cut[a].push_back(box.min[a]);
      cut[a].push_back(box.max[a]);
    }
  for (auto& c : cut) {
    std::sort(c.begin(), c.end());
    c.erase(std::unique(c.begin(), c.end()), c.end());
  }
  const auto is_solid = [&](std::array<int, 3> cell) {
    Vec3 centre;
    for (int a = 0; a < 3; ++a) {
      if (cell[a] < 0 || cell[a] + 1 >= static_cast<int>(cut[a].size())) return false;
      centre[a] = 0.5 * (cut[a][cell[a]] + cut[a][cell[a] + 1]);
    }
    return in_solid(shape.solid, centre);
  };
  std::vector<BoxFace> faces;
  std::array<int, 3> cell;
  for (cell[2] = 0; cell[2] + 1 < static_cast<int>(cut[2].size()); ++cell[2])
    for (cell[1] = 0; cell[1] + 1 < static_cast<int>(cut[1].size()); ++cell[1])
      for (cell[0] = 0; cell[0] + 1 < static_cast<int>(cut[0].size()); ++cell[0]) {
        if (!is_solid(cell)) continue;
        for (int a = 0; a < 3; ++a)
          for (int side : {-1, 1}) {
            auto beside = cell;
            beside[a] += side;
            if (shape.endless[a] || is_solid(beside)) continue;
            BoxFace face{a, side, {}, {}};
            for (int b = 0; b < 3; ++b) {
              face.min[b] = cut[b][cell[b]];
              face.max[b] = cut[b][cell[b] + 1];
            }
            face.min[a] = face.max[a] = side < 0 ? cut[a][cell[a]] : cut[a][cell[a] + 1];
            faces.push_back(face);
          }
      }
  return faces;
}

std::vector<ProfileEdge> surface_edges(const RevolvedShape& shape) {
  const auto& p = shape.profile;
  const int n = static_cast<int>(p.size());
  std::vector<int> edge_of(n, -1);
  std::vector<ProfileEdge> edges;
  for (int k = 0; k < n; ++k) {
    const auto& a = p[k];
    const auto& b = p[(k + 1) % n];
    if (a[0] == 0.0 && b[0] == 0.0) continue;
    edge_of[k] = static_cast<int>(edges.size());
    edges.push_back({a[0], a[1], b[0], b[1], -1, -1});
  }
  for (int k = 0; k < n; ++k) {
    if (edge_of[k] < 0) continue;
    edges[edge_of[k]].next = edge_of[(k + 1) % n];
    edges[edge_of[k]].previous = edge_of[(k + n - 1) % n];
  }
  return edges;
}

}  // namespace decant
