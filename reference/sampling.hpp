/// \file
/// Points that stand for a container: the wall particles that take part in the physics, and a
/// dense surface that is only looked at. Data, shared with every side.
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <array>

namespace decant {

/// Wall particles of one container at depths dx/2, 3dx/2, … (`wall_layers` of them) inside the
/// solid under every surface, spaced about dx, rounded to fp32.
BoundaryParticles sample_walls(const Scene& scene, const Container& container);

/// The same for every container of the scene, in its order.
Walls sample_walls(const Scene& scene);

/// Surface for pictures, container frame. Its vertices are the render boundary particles.
struct RenderSurface {
  Eigen::Matrix3Xd vertex;  // 3×V, m
  std::vector<std::array<std::int32_t, 3>> triangle;
};

/// \param spacing  m, longest edge along the profile and around it (boxes: along the faces)
RenderSurface render_surface(const Container& container, double spacing);

}  // namespace decant
