/// \file
/// The container shapes a scene file can name, built as general profiles and boxes.
#pragma once

#include "reference/scene.hpp"

namespace decant {

/// Cup with its inner bottom centred on the frame's origin, wall and bottom equally thick, flat rim.
/// All arguments in m.
RevolvedShape cup_shape(double inner_radius, double inner_height, double wall_thickness);

/// Which faces of a tank are missing, by axis and side: open[axis][0] the low one.
using OpenFaces = std::array<std::array<bool, 2>, 3>;

/// Tank whose cavity spans [0, size] of its frame. Walls stand outside the cavity, edges and
/// corners included; an open face has none.
/// \param size  3, m; \param wall_thickness  m
BoxShape tank_shape(const Vec3& size, double wall_thickness, const OpenFaces& open);

/// One rectangle of a box union's surface: the plane `axis` = `coordinate`, spanning min … max in
/// the other two axes; the outward normal is `side` (−1 or +1) along the axis.
struct BoxFace {
  int axis;
  int side;
  Vec3 min, max;  // m; min[axis] == max[axis]
};

/// The exposed rectangles of a union of boxes; none faces along an endless axis.
std::vector<BoxFace> exposed_faces(const BoxShape& shape);

/// One straight piece of a revolved outline that is surface.
struct ProfileEdge {
  double r0, z0, r1, z1;  // m, from → to, solid on the left
  int previous, next;     // index of the adjoining surface edge; −1: the edge ends on the axis
};

/// The outline's edges in order, those on the axis left out.
std::vector<ProfileEdge> surface_edges(const RevolvedShape& shape);

/// Number of surface edges that a ray in +r from (r, z) meets, m; odd inside the solid.
int crossings_outward(const std::vector<ProfileEdge>& edges, double r, double z);

/// True inside or on the union.
bool in_solid(const std::vector<SolidBox>& solid, const Vec3& local);

}  // namespace decant
