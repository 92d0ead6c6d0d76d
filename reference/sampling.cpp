/// \file
/// Wall particles lie inside the solid: on outlines inset by dx/2, 3dx/2, … and turned about the
/// axis (cups), or on a lattice anchored at the cavity's corner (boxes). Corners are mitred, so that
/// a corner of the solid is filled as a lattice would fill it. Where two faces' layers come close,
/// the particles crowd, and the boundary volume makes each count for less.
#include "reference/sampling.hpp"

#include "reference/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace decant {
namespace {

using Point2 = Eigen::Vector2d;

struct Line {
  Point2 from, direction;
};

/// The edge moved by `depth` to its left, into the solid.
Line inset(const ProfileEdge& e, double depth) {
  const Point2 direction = Point2(e.r1 - e.r0, e.z1 - e.z0).normalized();
  return {Point2(e.r0, e.z0) + depth * Point2(-direction.y(), direction.x()), direction};
}

/// Where two inset lines meet; parallel ones meet at `otherwise`.
Point2 meet(const Line& a, const Line& b, const Point2& otherwise) {
  const double cross = a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x();
  if (std::abs(cross) < 1e-9) return otherwise;
  const Point2 gap = b.from - a.from;
  return a.from + a.direction * (gap.x() * b.direction.y() - gap.y() * b.direction.x()) / cross;
}

double distance_to_outline(const std::vector<ProfileEdge>& edges, const Point2& p) {
  double best = INFINITY;
  for (const auto& e : edges) {
    const Point2 a(e.r0, e.z0), ab(e.r1 - e.r0, e.z1 - e.z0);
    const double s = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (p - a - s * ab).norm());
  }
  return best;
}

/// Points in (r, z) on the outline inset by `depth`, about dx apart.
std::vector<Point2> inset_points(const std::vector<ProfileEdge>& edges, double depth, double dx) {
  const Line axis{Point2::Zero(), Point2::UnitY()};
  std::vector<Point2> points;
  for (const auto& e : edges) {
    const Line line = inset(e, depth);
    const double length = Point2(e.r1 - e.r0, e.z1 - e.z0).norm();
    const Line before = e.previous < 0 ? axis : inset(edges[e.previous], depth);
    const Line after = e.next < 0 ? axis : inset(edges[e.next], depth);
    const Point2 from = meet(line, before, line.from);
    const Point2 to = meet(line, after, line.from + length * line.direction);
    const double inset_length = (to - from).dot(line.direction);
    if (inset_length < 0) continue;  // the solid is thinner than twice the depth here
    const int steps = std::max(1, static_cast<int>(std::lround(inset_length / dx)));
    const int last = e.next < 0 ? steps : steps - 1;  // the next edge begins where this one ends
    for (int k = 0; k <= last; ++k) points.push_back(from + (to - from) * k / steps);
  }
  // A mitred corner can stand out of a thin solid, or come too near to another face.
  std::erase_if(points, [&](const Point2& p) {
    return p.x() < 0 || crossings_outward(edges, p.x(), p.y()) % 2 == 0 ||
           distance_to_outline(edges, p) < 0.5 * dx * (1 - 1e-9);
  });
  return points;
}

Eigen::Matrix3Xd columns(const std::vector<Vec3>& points) {
  Eigen::Matrix3Xd m(3, static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < m.cols(); ++i) m.col(i) = points[static_cast<std::size_t>(i)];
  return m;
}

std::vector<Vec3> sample_revolved(const Scene& scene, const RevolvedShape& shape) {
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  const auto edges = surface_edges(shape);
  std::vector<Vec3> points;
  int ring = 0;
  for (int layer = 0; layer < scene.wall_layers; ++layer)
    for (const Point2& p : inset_points(edges, (layer + 0.5) * scene.particle_spacing, scene.particle_spacing)) {
      const double around = 2 * std::numbers::pi * p.x();
      const int n = std::max(1, static_cast<int>(std::lround(around / scene.particle_spacing)));
      // Rings start at unrelated angles, so that no seam runs up the cup.
      const double phase = golden_angle * ring++;
      for (int k = 0; k < n; ++k) {
        const double angle = phase + 2 * std::numbers::pi * k / n;
        points.emplace_back(p.x() * std::cos(angle), p.x() * std::sin(angle), p.y());
      }
    }
  return points;
}

std::vector<Vec3> sample_boxes(const Scene& scene, const BoxShape& shape) {
  const auto faces = exposed_faces(shape);
  const Vec3 extent = shape.cavity.max - shape.cavity.min;
  Vec3 spacing;
  for (int a = 0; a < 3; ++a) spacing[a] = extent[a] / std::max(1.0, std::round(extent[a] / scene.particle_spacing));
  // Depth counted along the axes, so that corners belong to the layer a lattice gives them.
  const auto layers_deep = [&](const Vec3& x) {
    double depth = INFINITY;
    for (const auto& f : faces) {
      const Vec3 gap = (x - x.cwiseMax(f.min).cwiseMin(f.max)).cwiseAbs();
      depth = std::min(depth, gap.cwiseQuotient(spacing).maxCoeff());
    }
    return depth;
  };
  std::vector<Vec3> points;
  for (std::size_t b = 0; b < shape.solid.size(); ++b) {
    const SolidBox& box = shape.solid[b];
    const std::vector<SolidBox> earlier(shape.solid.begin(), shape.solid.begin() + b);
    std::array<int, 3> low, high;
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<int>(std::ceil((box.min[a] - shape.cavity.min[a]) / spacing[a] - 0.5 - 1e-6));
      high[a] = static_cast<int>(std::floor((box.max[a] - shape.cavity.min[a]) / spacing[a] - 0.5 + 1e-6));
    }
    for (int k = low[2]; k <= high[2]; ++k)
      for (int j = low[1]; j <= high[1]; ++j)
        for (int i = low[0]; i <= high[0]; ++i) {
          const Vec3 x = shape.cavity.min + Vec3(i + 0.5, j + 0.5, k + 0.5).cwiseProduct(spacing);
          if (in_solid(earlier, x) || !(layers_deep(x) < scene.wall_layers)) continue;
          points.push_back(x);
        }
  }
  return points;
}

RenderSurface revolved_surface(const RevolvedShape& shape, double spacing) {
  const auto edges = surface_edges(shape);
  double widest = 0;
  for (const auto& e : edges) widest = std::max({widest, e.r0, e.r1});
  const int around = std::max(12, static_cast<int>(std::ceil(2 * std::numbers::pi * widest / spacing)));
  RenderSurface surface;
  std::vector<Vec3> vertices;
  for (const auto& e : edges) {
    const Point2 from(e.r0, e.z0), to(e.r1, e.z1);
    const int steps = std::max(1, static_cast<int>(std::ceil((to - from).norm() / spacing)));
    const auto first = static_cast<std::int32_t>(vertices.size());
    for (int k = 0; k <= steps; ++k) {
      const Point2 p = from + (to - from) * k / steps;
      for (int a = 0; a < around; ++a) {
        const double angle = 2 * std::numbers::pi * a / around;
        vertices.emplace_back(p.x() * std::cos(angle), p.x() * std::sin(angle), p.y());
      }
    }
    for (int k = 0; k < steps; ++k)
      for (int a = 0; a < around; ++a) {
        const std::int32_t here = first + k * around + a;
        const std::int32_t beside = first + k * around + (a + 1) % around;
        surface.triangle.push_back({here, beside, here + around});
        surface.triangle.push_back({beside, beside + around, here + around});
      }
  }
  surface.vertex = columns(vertices);
  return surface;
}

RenderSurface box_surface(const BoxShape& shape, double spacing) {
  RenderSurface surface;
  std::vector<Vec3> vertices;
  for (const auto& face : exposed_faces(shape)) {
    const int u = (face.axis + 1) % 3, v = (face.axis + 2) % 3;
    const Vec3 extent = face.max - face.min;
    const int nu = std::max(1, static_cast<int>(std::ceil(extent[u] / spacing)));
    const int nv = std::max(1, static_cast<int>(std::ceil(extent[v] / spacing)));
    const auto first = static_cast<std::int32_t>(vertices.size());
    for (int j = 0; j <= nv; ++j)
      for (int i = 0; i <= nu; ++i) {
        Vec3 x = face.min;
        x[u] += extent[u] * i / nu;
        x[v] += extent[v] * j / nv;
        vertices.push_back(x);
      }
    for (int j = 0; j < nv; ++j)
      for (int i = 0; i < nu; ++i) {
        const std::int32_t here = first + j * (nu + 1) + i, above = here + nu + 1;
        surface.triangle.push_back({here, here + 1, above});
        surface.triangle.push_back({here + 1, above + 1, above});
      }
  }
  surface.vertex = columns(vertices);
  return surface;
}

}  // namespace

BoundaryParticles sample_walls(const Scene& scene, const Container& container) {
  const auto* revolved = std::get_if<RevolvedShape>(&container.shape);
  const auto points =
      revolved ? sample_revolved(scene, *revolved) : sample_boxes(scene, std::get<BoxShape>(container.shape));
  return {columns(points).cast<float>().cast<double>()};
}

Walls sample_walls(const Scene& scene) {
  Walls walls;
  for (const auto& c : scene.containers) walls.containers.push_back(sample_walls(scene, c));
  return walls;
}

RenderSurface render_surface(const Container& container, double spacing) {
  if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) return revolved_surface(*revolved, spacing);
  return box_surface(std::get<BoxShape>(container.shape), spacing);
}

}  // namespace decant
