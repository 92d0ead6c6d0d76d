/// \file
/// Where containers and their fluid get to while they tilt and translate: extremes along a direction, the closest
/// approach of two containers, and the room inside a revolved shape.
#pragma once

#include "reference/scene.hpp"

#include <vector>

namespace decant {

/// Circle about the z axis of a container's frame, or a point where the radius is 0.
struct Ring {
  Vec3 center;    // m, container frame
  double radius;  // m
};

/// Rings whose convex hull is that of the container's solid.
std::vector<Ring> solid_rings(const Container& container);

/// Rings whose convex hull holds the fill as it stands at the start, in the frame of its container
/// (`container`) or of the world (null).
std::vector<Ring> fill_rings(const Fill& fill, const Container* container);

/// Rings of the cavity's bottom, container frame.
std::vector<Ring> cavity_bottom_rings(const Container& container);

/// Largest direction · x that the rings reach from time 0 to `end` (s), carried with the container
/// (null: at rest in the world).
///
/// Angles are sampled 0.01 rad apart or closer. Each point of a ring follows a sinusoid in the
/// angle whose amplitude is at most its distance from the tilt's line, rho, so the result falls
/// short of the true one by at most rho · 0.01² / 8 (1 µm at 80 mm). The farthest offset is added to
/// the farthest turn: a bound where a container does both. \param direction  unit vector, world
double farthest_along(const Vec3& direction, const std::vector<Ring>& rings, const Container* container, double end);

/// A bound of the rings' speed over the whole motion, m/s, from the steepest slopes of its schedules;
/// exact where the container only tilts or only translates between keys.
double fastest_point(const std::vector<Ring>& rings, const Container& container);

struct Approach {
  double distance;  // m, negative where the solids overlap
  double time;      // s
  Vec3 where;       // m, world, a surface point of one of them
};

/// Least distance between two containers' solids from time 0 to `end` (s), as far as it matters:
/// where it is at least `enough`, the result is some distance >= `enough`; otherwise it is at most
/// `slack` above the least one.
///
/// Branch and bound over pieces of surface and of time. A piece's middle is a true surface point at
/// a true time; no point of the piece at any of its times is nearer to the other solid by more than
/// the piece's radius plus the way both containers go. So a gap below `enough` − `slack` cannot
/// be missed, and none of `enough` or more is refused.
Approach closest_approach(const Container& a, const Container& b, double end, double enough, double slack);

/// Distance from the axis to the nearest solid at height z, m: 0 in the solid, infinite where the
/// shape has none.
double cavity_radius(const RevolvedShape& shape, double z);

/// Least cavity radius from z_low to z_high and the greatest one, m.
struct RadiusRange {
  double least, greatest;
};
RadiusRange cavity_radius(const RevolvedShape& shape, double z_low, double z_high);

/// Height of the cavity's bottom on the axis, or of the lowest solid where the shape is open there,
/// m.
double cavity_bottom(const RevolvedShape& shape);

/// True where the solid closes the shape on its axis, so that a level has a meaning.
bool closed_on_axis(const RevolvedShape& shape);

/// Height of the highest rim, m.
double rim_height(const RevolvedShape& shape);

}  // namespace decant
