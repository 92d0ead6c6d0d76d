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
/// What underflow takes from two inputs or products, and their sum.
const Vec3 underflow = Vec3::Constant(3 * smallest_normal);

/// A normal that may turn by more, rad, is ambiguous.
constexpr double most_turn = 0.1;

bool turns(const Pose& pose) {
  return !pose.rotation.isIdentity(0) || pose.pivot != Vec3::Zero() || pose.angular_velocity != Vec3::Zero();
}

/// How far the normal turns when the point moves by up to `e` in any direction. Twice as far along each
/// axis is farther than e along every direction, as 2 > √3. A surface as near as e may show any of the
/// normals around the point, an edge's whole fan of them: there it is asked in all 26 directions, near by
/// and farther out.
double turn_of_normal(const SolidDistance& solid, const Vec3& local, const SurfaceDistance& surface, double e) {
  double turn = 0;
  const SolidDistance::Nearby nearby = solid.nearby(local, surface.distance, 4 * e);  // no way is longer than 2 √3 e
  const auto ask = [&](const Vec3& way) {
    turn = std::max(turn, (nearby.at(local + way).normal - surface.normal).norm());
  };
  for (int a = 0; a < 3; ++a)
    for (double side : {-2.0, 2.0}) ask(side * e * Vec3::Unit(a));
  if (std::abs(surface.distance) > 4 * e) return turn;
  for (int k = 0; k < 27 && turn <= most_turn; ++k) {
    const Eigen::Vector3i way(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    for (double far : {0.25, 1.0, 2.0}) ask(far * e * way.cast<double>());
  }
  return turn;
}

}  // namespace

void BoundedParticle::take_in(const BoundedParticle& other) {
  const auto hold = [](VectorBound& tau, const VectorBound& its, const Vec3& apart) {
    tau.components = tau.components.cwiseMax(its.components + apart.cwiseAbs());
    tau.length = std::max(tau.length, its.length + apart.norm());
  };
  hold(tau_x, other.tau_x, other.x - x);
  hold(tau_v, other.tau_v, other.v - v);
  pushed = std::max(pushed, other.pushed);
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
  p.tau_v.add(dt * tau_a + 2 * u * (p.v.cwiseAbs() + dt * a.cwiseAbs()) + underflow);
  p.v += dt * a;
}

void ContactBounds::fly(BoundedParticle& p) const {
  const double dt = scene_.time_step();
  p.tau_x.components += dt * p.tau_v.components;
  p.tau_x.length += dt * p.tau_v.length;
  p.tau_x.add(u * (2 * p.x.cwiseAbs() + 4 * dt * p.v.cwiseAbs()) + underflow);
  p.x += dt * p.v;
  for (int c = 0; c < 3; ++c) {
    if (!scene_.domain.periodic[static_cast<std::size_t>(c)]) continue;
    const double low = scene_.domain.min[c], period = scene_.domain.max[c] - low;
    p.tau_x.add(4 * u * (period + std::abs(low)) * Vec3::Unit(c));
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
  p.tau_x = VectorBound::ball(p.tau_x.length + epsilon + way * (tau_n + 2 * u));
  p.tau_x.add(2 * u * p.x.cwiseAbs());

  const Vec3 wall = pose.velocity_at(p.x), w = v - wall;
  const double tau_wall = pose.angular_velocity.norm() *
                              (p.tau_x.length + 4 * u * (p.x.norm() + pose.pivot.norm() + (p.x - pose.pivot).norm())) +
                          3 * u * (pose.linear_velocity.norm() + pose.surface_velocity.norm() + wall.norm());
  const double tau_v = p.tau_v.length;
  if (w.dot(normal) > tau_v + tau_wall + w.norm() * (tau_n + 5 * u)) return;
  const double e = scene_.contact.restitution, k = (1 + e) * scene_.contact.friction;
  p.tau_v = VectorBound::ball((1 + k) * tau_v + (2 + k) * tau_wall + (2 + 2 * e + k) * w.norm() * tau_n +
                              8 * u * (1 + e + k) * w.norm() + 4 * u * (wall.norm() + p.v.norm()));
}

template <class Respond>
ContactBounds::Contact ContactBounds::meet(double distance, double e, BoundedParticle& p, Respond respond) const {
  const double reach = scene_.contact_distance();
  const bool touches = distance < reach;
  // Of what is ambiguous nobody asks how far off it may be.
  if (p.ambiguous || !(std::abs(distance - reach) <= e)) {
    if (!touches) return Contact::none;
    respond(p);
    return Contact::certain;
  }
  BoundedParticle responded = p;
  respond(responded);
  if ((responded.v - p.v).norm() <= responded.tau_v.length && responded.ambiguous == p.ambiguous) {
    BoundedParticle& own = touches ? responded : p;
    own.take_in(touches ? p : responded);
    p = own;
    return Contact::either;
  }
  const unsigned bit = 1u << std::min(p.undecided, 31);
  ++responded.undecided;
  ++p.undecided;
  if (touches == ((p.flips & bit) != 0)) return Contact::none;
  p = responded;
  return Contact::certain;
}

void ContactBounds::contact(std::size_t container, const Pose& pose, BoundedParticle& p) const {
  const SolidDistance& solid = solids_[container];
  const double reach = scene_.contact_distance();
  Contact before = Contact::certain;
  for (int projection = 0; projection < 2; ++projection) {
    const Vec3 local = pose.to_local(p.x);
    double epsilon = u * (2 * pose.translation.norm() + 16 * local.norm());
    if (turns(pose))
      epsilon += u * (pose.pivot.norm() + 8 * (p.x - pose.pivot).norm() + (pose.translation - pose.pivot).norm());
    const double e = p.tau_x.length + epsilon;
    if (!solid.may_be_within(reach + e, local)) return;
    const SurfaceDistance surface = solid.at(local);
    const Contact now = meet(surface.distance, e, p, [&](BoundedParticle& responding) {
      respond_to(container, surface, local, pose, epsilon, responding);
    });
    if (now == Contact::none) return;
    // Who does not touch at first is not looked at again.
    if (before == Contact::either && now == Contact::certain) p.ambiguous = true;
    before = now;
  }
}

void ContactBounds::respond_to(std::size_t container, const SurfaceDistance& surface, const Vec3& local,
                               const Pose& pose, double epsilon, BoundedParticle& p) const {
  if (p.ambiguous) return respond(surface.distance, pose.rotation * surface.normal, pose, epsilon, 2, p);
  const double e = p.tau_x.length + epsilon;
  double tau_n = turn_of_normal(solids_[container], local, surface, e) + 4 * u;
  if (turns(pose)) tau_n += 8 * u;
  const double phi = std::abs(surface.distance), extent = std::max(local.norm(), extents_[container]);
  const double tie = std::sqrt(6 * u * phi * phi + 8 * u * phi * extent);
  const bool seam = near_seam(container, local - surface.distance * surface.normal, tie + 2 * e);
  if (seam && phi > 0) tau_n += tie / phi;
  // A difference of near points; beside a box's face it has one component only.
  if (seam || faces_[container].empty()) tau_n += 4 * u * local.norm() / phi;
  if (!(tau_n <= most_turn)) {
    p.ambiguous = true;
    tau_n = 2;
  }
  respond(surface.distance, pose.rotation * surface.normal, pose, epsilon, tau_n, p);
}

void ContactBounds::collide(const std::vector<Pose>& poses, BoundedParticle& p) const {
  for (std::size_t c = 0; c < solids_.size(); ++c) contact(c, poses[c], p);
  if (!scene_.floor) return;
  const double height = p.x.z() - scene_.floor->height;
  const double epsilon = 4 * u * (std::abs(p.x.z()) + std::abs(scene_.floor->height));
  meet(height, p.tau_x.components.z() + epsilon, p,
       [&](BoundedParticle& responding) { respond(height, Vec3::UnitZ(), Pose{}, epsilon, 0, responding); });
}

}  // namespace decant
