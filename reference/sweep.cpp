/// \file
/// Sampling of tilt and translation with bounds on what lies between the samples.
#include "reference/sweep.hpp"

#include "reference/distance.hpp"
#include "reference/motion_bounds.hpp"
#include "reference/pose.hpp"
#include "reference/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace decant {
namespace {

/// \param line  a point of the tilt's line, world
double distance_to_line(const Tilt& tilt, const Vec3& line, const Vec3& world) {
  return tilt.axis.cross(world - line).norm();
}

std::vector<Ring> corners(const SolidBox& box) {
  std::vector<Ring> rings;
  for (int k = 0; k < 8; ++k)
    rings.push_back(
        {{(k & 1 ? box.max : box.min).x(), (k & 2 ? box.max : box.min).y(), (k & 4 ? box.max : box.min).z()}, 0.0});
  return rings;
}

/// The container turned by `angle` (rad), for good, and not translated.
Pose pose_turned(const Container& container, double angle) {
  Container turned = container;
  turned.tilt->keys.assign(1, {0.0, angle});
  turned.tilt->rate = 0;
  turned.tilt->oscillation.reset();
  turned.translation.reset();
  return pose_at(turned, 0.0);
}

/// A rectangle of surface: of a revolved edge by (fraction, angle), or of a box face by its two
/// axes.
struct Patch {
  const ProfileEdge* edge;  // null: a box face
  Vec3 low, high;           // box face: opposite corners; edge: (fraction, angle, 0)

  Vec3 middle() const {
    const Vec3 m = 0.5 * (low + high);
    if (!edge) return m;
    const double r = edge->r0 + m.x() * (edge->r1 - edge->r0);
    const double z = edge->z0 + m.x() * (edge->z1 - edge->z0);
    return {r * std::cos(m.y()), r * std::sin(m.y()), z};
  }

  /// Half lengths along the parameters. The chord across an arc is no longer than the arc, so their
  /// norm bounds the distance of any point of the patch from its middle.
  Vec3 half_lengths() const {
    const Vec3 half = 0.5 * (high - low);
    if (!edge) return half;
    return {half.x() * std::hypot(edge->r1 - edge->r0, edge->z1 - edge->z0), half.y() * std::max(edge->r0, edge->r1),
            0.0};
  }
};

std::vector<Patch> surface_patches(const std::vector<ProfileEdge>& edges, const std::vector<BoxFace>& faces) {
  std::vector<Patch> patches;
  for (const auto& e : edges) patches.push_back({&e, Vec3::Zero(), Vec3(1.0, 2 * std::numbers::pi, 0.0)});
  for (const auto& f : faces) patches.push_back({nullptr, f.min, f.max});
  return patches;
}

/// A bound of the way that a point within `radius` of `world` goes, carried with the container, from
/// the middle of `from` … `to` to any time between them. It can go no farther than round its circle.
double way_between(const Container& container, const Pose& pose, double from, double to, const Vec3& world,
                   double radius) {
  const double half = 0.5 * (to - from);
  double way = 0;
  if (container.tilt)
    way += std::min(2.0, greatest_rate(*container.tilt, from, to) * half) *
           (distance_to_line(*container.tilt, pose.pivot, world) + radius);
  if (container.translation) way += greatest_speed(*container.translation, from, to) * half;
  return way;
}

/// Improves `best` with the surface of `a` against the solid of `b`.
void approach_one_way(const Container& a, const Container& b, double end, double enough, double slack, Approach& best) {
  const auto* revolved = std::get_if<RevolvedShape>(&a.shape);
  const auto edges = revolved ? surface_edges(*revolved) : std::vector<ProfileEdge>{};
  const auto faces = revolved ? std::vector<BoxFace>{} : exposed_faces(std::get<BoxShape>(a.shape));
  const SolidDistance solid(b);

  struct Piece {
    Patch patch;
    double from, to;
  };
  end = until_repetition({&a, &b}, end);
  std::vector<double> times = key_times(a, end);
  for (double t : key_times(b, end)) times.push_back(t);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  if (times.size() == 1) times = {0.0, 0.0};  // nothing moves
  std::vector<Piece> pieces;
  for (std::size_t k = 0; k + 1 < times.size(); ++k)
    for (const auto& patch : surface_patches(edges, faces)) pieces.push_back({patch, times[k], times[k + 1]});

  while (!pieces.empty()) {
    const Piece piece = pieces.back();
    pieces.pop_back();
    const double middle = 0.5 * (piece.from + piece.to);
    const Pose pose_a = pose_at(a, middle), pose_b = pose_at(b, middle);
    const Vec3 world = pose_a.to_world(piece.patch.middle());
    const double distance = solid.at(pose_b.to_local(world)).distance;
    if (distance < best.distance) best = {distance, middle, world};

    const Vec3 half = piece.patch.half_lengths();
    double way = way_between(a, pose_a, piece.from, piece.to, world, half.norm());
    way += way_between(b, pose_b, piece.from, piece.to, world, half.norm() + way);
    if (distance - half.norm() - way >= std::min(enough, best.distance) - slack) continue;

    Piece lower = piece, upper = piece;
    if (way > half.norm()) {
      lower.to = upper.from = middle;
    } else {
      Eigen::Index longest;
      half.maxCoeff(&longest);
      lower.patch.high[longest] = upper.patch.low[longest] =
          0.5 * (piece.patch.low[longest] + piece.patch.high[longest]);
    }
    pieces.push_back(lower);
    pieces.push_back(upper);
  }
}

}  // namespace

std::vector<Ring> solid_rings(const Container& container) {
  std::vector<Ring> rings;
  if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
    for (const auto& p : revolved->profile) rings.push_back({{0, 0, p[1]}, p[0]});
    return rings;
  }
  for (const auto& box : std::get<BoxShape>(container.shape).solid)
    for (const auto& corner : corners(box)) rings.push_back(corner);
  return rings;
}

std::vector<Ring> fill_rings(const Fill& fill, const Container* container) {
  if (fill.box) return corners(*fill.box);
  if (const auto* revolved = std::get_if<RevolvedShape>(&container->shape)) {
    const double bottom = cavity_bottom(*revolved), top = bottom + fill.level;
    double widest = cavity_radius(*revolved, bottom, top).greatest;
    if (!std::isfinite(widest)) {
      widest = 0;
      for (const auto& p : revolved->profile) widest = std::max(widest, p[0]);
    }
    return {{{0, 0, bottom}, widest}, {{0, 0, top}, widest}};
  }
  SolidBox box = std::get<BoxShape>(container->shape).cavity;
  box.max.z() = box.min.z() + fill.level;
  return corners(box);
}

std::vector<Ring> cavity_bottom_rings(const Container& container) {
  if (const auto* revolved = std::get_if<RevolvedShape>(&container.shape)) {
    const double bottom = cavity_bottom(*revolved);
    const double radius = cavity_radius(*revolved, bottom, rim_height(*revolved)).greatest;
    return {{{0, 0, bottom}, std::isfinite(radius) ? radius : 0.0}};
  }
  return corners(std::get<BoxShape>(container.shape).cavity);
}

double farthest_along(const Vec3& direction, const std::vector<Ring>& rings, const Container* container, double end) {
  const auto at_pose = [&](const Pose& pose) {
    const Vec3 local = pose.rotation.transpose() * direction;
    double farthest = -infinity;
    for (const auto& ring : rings)
      farthest = std::max(farthest,
                          direction.dot(pose.to_world(ring.center)) + ring.radius * std::hypot(local.x(), local.y()));
    return farthest;
  };
  if (!container) return at_pose(Pose{});
  const double along = container->translation ? farthest_offset(*container->translation, direction, end) : 0.0;
  if (!container->tilt) {
    Container still = *container;
    still.translation.reset();
    return at_pose(pose_at(still, 0.0)) + along;
  }
  AngleRange range = angle_range(*container->tilt, end);
  range.high = std::min(range.high, range.low + 2 * std::numbers::pi);
  const int steps = std::max(1, static_cast<int>(std::ceil((range.high - range.low) / 0.01)));
  double farthest = -infinity;
  for (int k = 0; k <= steps; ++k)
    farthest = std::max(farthest, at_pose(pose_turned(*container, range.low + (range.high - range.low) * k / steps)));
  return farthest + along;
}

double fastest_point(const std::vector<Ring>& rings, const Container& container) {
  double speed = 0;
  if (container.translation) speed = greatest_speed(*container.translation, 0.0, infinity);
  if (!container.tilt) return speed;
  const Pose pose = pose_turned(container, 0.0);
  double farthest = 0;
  for (const auto& ring : rings)
    farthest = std::max(
        farthest, distance_to_line(*container.tilt, container.tilt->pivot, pose.to_world(ring.center)) + ring.radius);
  return speed + greatest_rate(*container.tilt, 0.0, infinity) * farthest;
}

Approach closest_approach(const Container& a, const Container& b, double end, double enough, double slack) {
  Approach best{infinity, 0.0, Vec3::Zero()};
  approach_one_way(a, b, end, enough, slack, best);
  approach_one_way(b, a, end, enough, slack, best);
  return best;
}

double cavity_radius(const RevolvedShape& shape, double z) {
  int crossings = 0;
  double nearest = infinity;
  for (const auto& e : surface_edges(shape)) {
    if ((e.z0 > z) == (e.z1 > z)) continue;
    ++crossings;
    nearest = std::min(nearest, e.r0 + (z - e.z0) / (e.z1 - e.z0) * (e.r1 - e.r0));
  }
  return crossings % 2 == 1 ? 0.0 : nearest;
}

RadiusRange cavity_radius(const RevolvedShape& shape, double z_low, double z_high) {
  // Between the outline's points the radius is linear in z, so it is extreme beside them or at an
  // end of the interval; just inside of each, because it may jump there.
  const double nudge = 1e-9 * (z_high - z_low);
  std::vector<double> heights = {z_low + nudge, z_high - nudge};
  for (const auto& p : shape.profile)
    for (double z : {p[1] - nudge, p[1] + nudge})
      if (z > z_low && z < z_high) heights.push_back(z);
  RadiusRange range{infinity, 0.0};
  for (double z : heights) {
    const double radius = cavity_radius(shape, z);
    range.least = std::min(range.least, radius);
    range.greatest = std::max(range.greatest, radius);
  }
  return range;
}

double cavity_bottom(const RevolvedShape& shape) {
  double highest = -infinity, lowest = infinity;
  for (const auto& p : shape.profile) {
    if (p[0] == 0.0) highest = std::max(highest, p[1]);
    lowest = std::min(lowest, p[1]);
  }
  return std::isfinite(highest) ? highest : lowest;
}

bool closed_on_axis(const RevolvedShape& shape) {
  return std::any_of(shape.profile.begin(), shape.profile.end(), [](const auto& p) { return p[0] == 0.0; });
}

double rim_height(const RevolvedShape& shape) {
  double highest = -infinity;
  for (const auto& p : shape.profile) highest = std::max(highest, p[1]);
  return highest;
}

}  // namespace decant
