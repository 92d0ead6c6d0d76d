/// \file
/// Push-out and response as in reference/solver.cpp, with what fp32 can make of them.
#include "oracle/solution/contact_bounds.hpp"

#include "oracle/solution/tolerance.hpp"
#include "reference/solver.hpp"

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

constexpr double u = unit_roundoff;

bool turns(const Pose& pose) {
  return !pose.rotation.isIdentity(0) || pose.pivot != Vec3::Zero() || pose.angular_velocity != Vec3::Zero();
}

/// How far the normal turns when the point moves by up to `e` in any direction. Twice as far along each
/// axis is farther than e along every direction, as 2 > √3. A surface as near as e may show any of the
/// normals around the point, an edge's whole fan of them: there it is asked in all 26 directions, near by
/// and farther out.
double turn_of_normal(const SolidDistance& solid, const Vec3& local, const SurfaceDistance& surface, double e) {
  double turn = 0;
  const auto ask = [&](const Vec3& way) {
    turn = std::max(turn, (solid.at(local + way).normal - surface.normal).norm());
  };
  for (int a = 0; a < 3; ++a)
    for (double side : {-2.0, 2.0}) ask(side * e * Vec3::Unit(a));
  if (std::abs(surface.distance) > 4 * e) return turn;
  for (int k = 0; k < 27; ++k) {
    const Eigen::Vector3i way(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    for (double far : {0.25, 1.0, 2.0}) ask(far * e * way.cast<double>());
  }
  return turn;
}

}  // namespace

bool BoundedParticle::touches(double distance, double reach, double e) {
  const bool touching = distance < reach;
  if (!(std::abs(distance - reach) <= e)) return touching;
  const unsigned bit = 1u << std::min(undecided++, 31);
  return touching != ((flips & bit) != 0);
}

ContactBounds::ContactBounds(const Scene& scene)
    : scene_(scene), solids_(scene.containers.begin(), scene.containers.end()) {
  for (const Container& c : scene.containers) {
    const auto* revolved = std::get_if<RevolvedShape>(&c.shape);
    edges_.push_back(revolved ? surface_edges(*revolved) : std::vector<ProfileEdge>{});
    faces_.push_back(revolved ? std::vector<BoxFace>{} : exposed_faces(std::get<BoxShape>(c.shape)));
    double& extent = extents_.emplace_back(0);
    for (const ProfileEdge& e : edges_.back()) extent = std::max({extent, std::abs(e.r0), std::abs(e.z0)});
    for (const BoxFace& f : faces_.back())
      for (int a = 0; a < 3; ++a)
        if (std::isfinite(f.min[a]) && std::isfinite(f.max[a]))  // not along an endless axis
          extent = std::max({extent, std::abs(f.min[a]), std::abs(f.max[a])});
  }
}

bool ContactBounds::near_seam(std::size_t container, const Vec3& place, double width) const {
  const double r = std::hypot(place.x(), place.y());
  for (const ProfileEdge& e : edges_[container])
    if (std::hypot(r - e.r0, place.z() - e.z0) <= width || std::hypot(r - e.r1, place.z() - e.z1) <= width) return true;
  for (const BoxFace& f : faces_[container]) {
    bool on_face = true, at_end = false;
    for (int a = 0; a < 3; ++a) {
      on_face = on_face && place[a] >= f.min[a] - width && place[a] <= f.max[a] + width;
      at_end =
          at_end || (a != f.axis && (std::abs(place[a] - f.min[a]) <= width || std::abs(place[a] - f.max[a]) <= width));
    }
    if (on_face && at_end) return true;
  }
  return false;
}

std::vector<Pose> ContactBounds::poses_at(double time) const {
  std::vector<Pose> poses;
  for (const auto& c : scene_.containers) poses.push_back(pose_at(c, time));
  return poses;
}

void ContactBounds::accelerate(const Vec3& a, const Vec3& tau_a, BoundedParticle& p) const {
  const double dt = scene_.time_step();
  p.tau_v += dt * tau_a + 2 * u * (p.v.cwiseAbs() + dt * a.cwiseAbs());
  p.v += dt * a;
}

void ContactBounds::fly(BoundedParticle& p) const {
  const double dt = scene_.time_step();
  p.tau_x += dt * p.tau_v + u * (2 * p.x.cwiseAbs() + 4 * dt * p.v.cwiseAbs());
  p.x += dt * p.v;
  for (int c = 0; c < 3; ++c) {
    if (!scene_.domain.periodic[static_cast<std::size_t>(c)]) continue;
    const double low = scene_.domain.min[c], period = scene_.domain.max[c] - low;
    p.tau_x[c] += 4 * u * (period + std::abs(low));
    p.x[c] -= period * std::floor((p.x[c] - low) / period);
  }
}

void ContactBounds::respond(double distance, const Vec3& normal, const Pose& pose, double epsilon, double tau_n,
                            BoundedParticle& p) const {
  const double reach = scene_.contact_distance(), way = std::max(0.0, reach - distance);
  const Vec3 v = p.v;
  // Also where the oracle's own distance is not within reach.
  push_out(scene_, std::min(distance, std::nextafter(reach, -1.0)), normal, pose, p.x, p.v);
  p.pushed += way;
  p.tau_x = (p.tau_x.norm() + epsilon + way * (tau_n + 2 * u)) * Vec3::Ones() + 2 * u * p.x.cwiseAbs();

  const Vec3 wall = pose.velocity_at(p.x), w = v - wall;
  const double tau_wall = pose.angular_velocity.norm() *
                              (p.tau_x.norm() + 4 * u * (p.x.norm() + pose.pivot.norm() + (p.x - pose.pivot).norm())) +
                          3 * u * (pose.linear_velocity.norm() + pose.surface_velocity.norm() + wall.norm());
  const double tau_v = p.tau_v.norm();
  if (w.dot(normal) > tau_v + tau_wall + w.norm() * (tau_n + 5 * u)) return;
  const double e = scene_.contact.restitution, k = (1 + e) * scene_.contact.friction;
  p.tau_v = ((1 + k) * tau_v + (2 + k) * tau_wall + (2 + 2 * e + k) * w.norm() * tau_n +
             8 * u * (1 + e + k) * w.norm() + 4 * u * (wall.norm() + p.v.norm())) *
            Vec3::Ones();
}

void ContactBounds::contact(std::size_t container, const Pose& pose, BoundedParticle& p) const {
  const SolidDistance& solid = solids_[container];
  const double reach = scene_.contact_distance();
  for (int projection = 0; projection < 2; ++projection) {
    const Vec3 local = pose.to_local(p.x);
    double epsilon = u * (2 * pose.translation.norm() + 16 * local.norm());
    if (turns(pose))
      epsilon += u * (pose.pivot.norm() + 8 * (p.x - pose.pivot).norm() + (pose.translation - pose.pivot).norm());
    const double e = p.tau_x.norm() + epsilon;
    if (!solid.may_be_within(reach + e, local)) return;
    const SurfaceDistance surface = solid.at(local);
    if (!p.touches(surface.distance, reach, e)) return;
    double tau_n = turn_of_normal(solid, local, surface, e) + 4 * u;
    if (turns(pose)) tau_n += 8 * u;
    const double phi = std::abs(surface.distance), extent = std::max(local.norm(), extents_[container]);
    const double tie = std::sqrt(6 * u * phi * phi + 8 * u * phi * extent);
    const bool seam = near_seam(container, local - surface.distance * surface.normal, tie + 2 * e);
    if (seam && phi > 0) tau_n += tie / phi;
    // A difference of near points; beside a box's face it has one component only.
    if (seam || faces_[container].empty()) tau_n += 4 * u * local.norm() / phi;
    if (!(tau_n <= 0.1)) {
      p.ambiguous = true;
      tau_n = 2;
    }
    respond(surface.distance, pose.rotation * surface.normal, pose, epsilon, tau_n, p);
  }
}

void ContactBounds::collide(const std::vector<Pose>& poses, BoundedParticle& p) const {
  for (std::size_t c = 0; c < solids_.size(); ++c) contact(c, poses[c], p);
  if (!scene_.floor) return;
  const double height = p.x.z() - scene_.floor->height;
  const double epsilon = 4 * u * (std::abs(p.x.z()) + std::abs(scene_.floor->height));
  if (p.touches(height, scene_.contact_distance(), p.tau_x.z() + epsilon))
    respond(height, Vec3::UnitZ(), Pose{}, epsilon, 0, p);
}

}  // namespace decant
