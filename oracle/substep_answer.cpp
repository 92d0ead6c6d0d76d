/// \file
/// The oracle's substep once more, carrying an error bound along with every particle.
#include "oracle/substep_answer.hpp"

#include "reference/solver.hpp"

#include <cmath>

namespace decant {
namespace {

constexpr double u = unit_roundoff;

struct Particle {
  Vec3 x, v;
  Vec3 tau_x, tau_v;
  bool ambiguous = false;
};

/// How far the normal turns when the point moves by `e` along any axis.
double turn_of_normal(const SolidDistance& solid, const Vec3& local, const Vec3& normal, double e) {
  double turn = 4 * u;
  for (int a = 0; a < 3; ++a)
    for (double side : {-1.0, 1.0})
      turn = std::max(turn, (solid.at(local + side * e * Vec3::Unit(a)).normal - normal).norm());
  return 2 * turn;
}

/// What a push-out with normal error tau_n and distance error e adds.
void widen(const Scene& scene, const Pose& pose, double distance, double tau_n, double e,
           Particle& p) {
  const Vec3 w = p.v - pose.velocity_at(p.x);
  const double omega = pose.angular_velocity.norm();
  p.tau_x.array() += (scene.contact_distance() - distance) * tau_n + e;
  p.tau_v.array() += (1 + scene.contact.restitution + scene.contact.friction) *
                         (2 * w.norm() * tau_n + p.tau_v.norm()) +
                     2 * omega * (p.tau_x.norm() + 4 * u * (p.x.norm() + pose.pivot.norm())) +
                     4 * u * (p.v.norm() + w.norm());
}

void contact(const Scene& scene, const SolidDistance& solid, const Pose& pose, Particle& p) {
  for (int projection = 0; projection < 2; ++projection) {
    const Vec3 local = pose.to_local(p.x);
    const double e = p.tau_x.norm() +
                     8 * u * (p.x.cwiseAbs().maxCoeff() + pose.translation.cwiseAbs().maxCoeff() +
                              local.cwiseAbs().maxCoeff());
    const double reach = scene.contact_distance();
    if (!solid.may_be_within(reach + e, local)) return;
    const SurfaceDistance surface = solid.at(local);
    if (std::abs(surface.distance - reach) <= e) p.ambiguous = true;
    if (!(surface.distance < reach)) return;
    const double tau_n = turn_of_normal(solid, local, surface.normal, e);
    if (tau_n > 0.1) p.ambiguous = true;
    widen(scene, pose, surface.distance, tau_n, e, p);
    push_out(scene, surface.distance, pose.rotation * surface.normal, pose, p.x, p.v);
  }
}

}  // namespace

SubstepAnswer substep_answer(const Scene& scene, const ParticleState& state,
                             const OracleAnswer& fields) {
  const double dt = scene.time_step();
  const std::vector<SolidDistance> solids(scene.containers.begin(), scene.containers.end());
  std::vector<Pose> poses;
  for (const auto& c : scene.containers) poses.push_back(pose_at(c, scene.time_at(state.substep + 1)));

  const auto n = state.size();
  SubstepAnswer answer;
  answer.state = state;
  ++answer.state.substep;
  answer.position_tolerance.resize(3, n);
  answer.velocity_tolerance.resize(3, n);
  answer.ambiguous.assign(static_cast<std::size_t>(n), false);
  answer.most_ambiguous = n / 50 + 10;
  for (Eigen::Index i = 0; i < n; ++i) {
    Particle p;
    const Vec3 a = fields.fields.acceleration.col(i);
    p.v = state.velocity.col(i) + dt * a;
    p.tau_v = dt * fields.tolerance.acceleration.col(i) +
              2 * u * (state.velocity.col(i).cwiseAbs() + dt * a.cwiseAbs());
    p.x = state.position.col(i) + dt * p.v;
    p.tau_x = dt * p.tau_v + 2 * u * (state.position.col(i).cwiseAbs() + dt * p.v.cwiseAbs());
    for (int c = 0; c < 3; ++c) {
      if (!scene.domain.periodic[c]) continue;
      const double low = scene.domain.min[c], period = scene.domain.max[c] - low;
      const double turns = (p.x[c] - low) / period;
      p.tau_x[c] += 4 * u * (period + std::abs(low));
      if (std::abs(turns - std::round(turns)) <= p.tau_x[c] / period) p.ambiguous = true;
      p.x[c] -= period * std::floor(turns);
    }
    for (std::size_t c = 0; c < solids.size(); ++c) contact(scene, solids[c], poses[c], p);
    if (scene.floor) {
      const double height = p.x.z() - scene.floor->height;
      const double e = p.tau_x.z() + 4 * u * (std::abs(p.x.z()) + std::abs(scene.floor->height));
      if (std::abs(height - scene.contact_distance()) <= e) p.ambiguous = true;
      if (height < scene.contact_distance()) {
        widen(scene, Pose{}, height, 0, e, p);
        push_out(scene, height, Vec3::UnitZ(), Pose{}, p.x, p.v);
      }
    }
    answer.state.position.col(i) = p.x;
    answer.state.velocity.col(i) = p.v;
    answer.position_tolerance.col(i) = p.tau_x;
    answer.velocity_tolerance.col(i) = p.tau_v;
    answer.ambiguous[static_cast<std::size_t>(i)] = p.ambiguous;
  }
  return answer;
}

}  // namespace decant
