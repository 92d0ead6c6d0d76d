/// \file
/// Exact signed distance to a container's solid. Physics: gpu/ writes its own.
#pragma once

#include "reference/scene.hpp"
#include "reference/shapes.hpp"

namespace decant {

struct SurfaceDistance {
  double distance;  // m, positive outside the solid
  Vec3 normal;      // unit, outward gradient of the distance, container frame
};

/// Distance to one container's solid, prepared once for many points.
class SolidDistance {
 public:
  explicit SolidDistance(const Container& container);

  /// Signed distance from a point to the solid and its gradient.
  ///
  /// Revolved shapes: distance in the (r, z) half-plane, because the nearest surface point lies in
  /// the point's own meridian. Boxes: distance to the exposed faces of the union.
  /// Where the gradient is not unique: on the axis the meridian is that of +x; among equally near
  /// surface points the first edge or face of the shape's list is taken.
  /// \param local  3, m, container frame
  SurfaceDistance at(const Vec3& local) const;

  class Nearby;
  /// For many questions close to one place.
  /// \param around  3, m, container frame; \param distance  m, what `at` says there; \param radius  m, of the
  /// points that are to be asked
  Nearby nearby(const Vec3& around, double distance, double radius) const;

  /// True where the point lies in the container's room for fluid, solid excluded: below the highest
  /// rim, with solid beneath it and solid farther from the axis at the same height (revolved), or
  /// in the cavity box.
  /// \param local  3, m, container frame
  bool in_cavity(const Vec3& local) const;

  /// False where the point is certainly farther than `reach` (m) from the solid's bounding box.
  bool may_be_within(double reach, const Vec3& local) const {
    return (local.array() >= low_.array() - reach).all() && (local.array() <= high_.array() + reach).all();
  }

 private:
  bool revolved_;
  std::vector<ProfileEdge> edges_;  // revolved
  BoxShape box_;                    // boxes
  std::vector<BoxFace> faces_;
  Vec3 low_, high_;
};

/// A solid for the points within a radius of a place: `at` gives what the solid's own does, bit for bit, from the
/// edges or faces that are nearest to one of these points. One that is farther from the place than the nearest by
/// more than twice the radius is nearest to none of them, as no distance changes by more than the point moves; for
/// the same reason all of them are on one side of a surface that is farther than the radius.
class SolidDistance::Nearby {
 public:
  SurfaceDistance at(const Vec3& local) const;

 private:
  friend class SolidDistance;
  explicit Nearby(const SolidDistance& solid) : solid_(solid) {}

  const SolidDistance& solid_;
  std::vector<ProfileEdge> edges_;
  std::vector<BoxFace> faces_;
  double sign_ = 0;  // of all distances; 0: either
};

/// SolidDistance(container).at(local), for a single point.
inline SurfaceDistance signed_distance(const Container& container, const Vec3& local) {
  return SolidDistance(container).at(local);
}

/// SolidDistance(container).in_cavity(local), for a single point.
inline bool in_cavity(const Container& container, const Vec3& local) {
  return SolidDistance(container).in_cavity(local);
}

}  // namespace decant
