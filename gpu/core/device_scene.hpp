/// \file
/// A scene as the device sees it: floats and plain structs, converted once on the host. Every
/// constant that a formula needs is derived here from scene data, apart from the reference.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace decant {
struct Scene;
struct Walls;

namespace gpu {

enum class KernelId : int { cubic_spline, wendland_c2, mueller2003 };

struct Float3 {
  float x, y, z;

  bool operator==(const Float3&) const = default;
};

/// Constants of one scene. Units SI; H support radius, h = H/2.
struct Constants {
  KernelId kernel;
  float H, H2, inverse_h, h2_soft;  // m, m², 1/m, 0.01 h² in m²
  float w_norm, g_norm;             // of W (mueller2003: of poly6) and of G (spiky)
  float g_near[2], g_far;           // cubic_spline's G: g_near[0] − g_near[1] q, g_far (2 − q)²/r
  float spacing;                    // dx, m
  float mass, rest_density, inverse_rest_density;
  float stiffness;   // B, Pa
  int eos_exponent;  // 7 or 1
  bool allow_tension;
  float viscosity, wall_viscosity;  // Pa·s
  Float3 gravity;
  float dt;
  float contact_distance, restitution, friction;
  bool has_floor;
  float floor_height;
  bool periodic[3], any_periodic;
  float domain_min[3], domain_max[3], period[3], inverse_period[3];  // 0 on a free axis

  bool operator==(const Constants&) const = default;
};

/// Edge of a revolved outline in (r, z), solid on the left.
struct alignas(16) Edge {
  float r0, z0, dr, dz;  // from its start to its end
  float z1;
  float inverse_length2;  // 1/(dr² + dz²)
  float slope;            // dr/dz; 0 where dz is

  bool operator==(const Edge&) const = default;
};

struct Box {
  Float3 min, max;

  /// With its lower faces and without its upper ones, so that boxes side by side share nothing.
  constexpr bool holds(const Float3& x) const {
    return x.x >= min.x && x.x < max.x && x.y >= min.y && x.y < max.y && x.z >= min.z && x.z < max.z;
  }
  bool operator==(const Box&) const = default;
};

/// Exposed rectangle of a box union; its outward normal is `side` along `axis`.
struct alignas(16) Face {
  Float3 min, max;
  int axis, side;

  bool operator==(const Face&) const = default;
};

/// Where a container's outline or boxes lie in the arrays of Geometry.
struct Shape {
  bool revolved;
  int first_edge, edges, first_box, boxes, first_face, faces;
  Float3 low, high;  // bounding box, container frame

  bool operator==(const Shape&) const = default;
};

struct Geometry {
  std::vector<Shape> shapes;  // one a container
  std::vector<Edge> edges;
  std::vector<Box> boxes;
  std::vector<Face> faces;

  bool operator==(const Geometry&) const = default;
};

/// x_world = R x_local + translation; velocity = omega × (x_world − pivot) + surface, which is what the
/// pivot moves with and what the surface slides with over its place, together.
struct DevicePose {
  float R[9];  // row by row
  Float3 translation, pivot, omega, surface;
  float step;  // how far any point of the solid has moved since the pose before, at most, m
};

/// Wall particles of all containers in their frames, container by container.
struct WallSamples {
  std::vector<float> x, y, z;         // m, container frame
  std::vector<int> container_begin;   // containers + 1
  std::vector<bool> container_moves;  // containers

  bool operator==(const WallSamples&) const = default;
};

Constants make_constants(const Scene& scene);
Geometry make_geometry(const Scene& scene);
/// Where fluid is to be expected, m, world: around the containers as they stand at the start and the fills,
/// cut to the domain; the domain where there is neither. Of the scene alone.
Box make_region(const Scene& scene);
WallSamples make_wall_samples(const Scene& scene, const Walls& walls);

/// Poses of all containers at `count` substeps from `first` on: count × containers, substep major. The
/// first step is 0.
std::vector<DevicePose> make_poses(const Scene& scene, std::int64_t first, int count);

}  // namespace gpu
}  // namespace decant
