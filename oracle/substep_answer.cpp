/// \file
/// The oracle's substep once more, carrying an error bound along with every particle.
#include "oracle/substep_answer.hpp"

#include "reference/solver.hpp"

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

constexpr double u = unit_roundoff;

struct Particle {
  Vec3 x, v;
  Vec3 tau_x, tau_v;
  bool ambiguous = false;
  /// Contacts that fp32 cannot decide, so far; bit k of `flips` turns the k-th round.
  int undecided = 0;
  unsigned flips = 0;
  double pushed = 0;  // m, all pushes together

  /// Whether there is contact at this distance, known within e.
  bool touches(double distance, double reach, double e) {
    const bool touching = distance < reach;
    if (!(std::abs(distance - reach) <= e)) return touching;
    const unsigned bit = 1u << std::min(undecided++, 31);
    return touching != ((flips & bit) != 0);
  }
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
  // The way to go is a difference, rounded, and so is where it leads.
  const double way = scene.contact_distance() - distance;
  p.tau_x += (way * (tau_n + 2 * u) + e) * Vec3::Ones() + 2 * u * p.x.cwiseAbs();
  p.tau_v.array() += (1 + scene.contact.restitution + scene.contact.friction) *
                         (2 * w.norm() * tau_n + p.tau_v.norm()) +
                     2 * omega * (p.tau_x.norm() + 4 * u * (p.x.norm() + pose.pivot.norm())) +
                     4 * u * (p.v.norm() + w.norm() + pose.linear_velocity.norm() +
                              pose.surface_velocity.norm());
}

/// The push-out itself, also where the oracle's own distance is not within reach.
void push(const Scene& scene, double distance, const Vec3& normal, const Pose& pose, Particle& p) {
  const double reach = scene.contact_distance();
  p.pushed += std::max(0.0, reach - distance);
  push_out(scene, std::min(distance, std::nextafter(reach, 0.0)), normal, pose, p.x, p.v);
}

void contact(const Scene& scene, const SolidDistance& solid, const Pose& pose, Particle& p) {
  for (int projection = 0; projection < 2; ++projection) {
    const Vec3 local = pose.to_local(p.x);
    // The translation is rounded, so is the difference with it; rotation and distance add a few.
    const double e = p.tau_x.norm() +
                     u * (2 * pose.translation.norm() + 2 * p.x.norm() + 8 * local.norm());
    const double reach = scene.contact_distance();
    if (!solid.may_be_within(reach + e, local)) return;
    const SurfaceDistance surface = solid.at(local);
    if (!p.touches(surface.distance, reach, e)) return;
    const double tau_n = turn_of_normal(solid, local, surface.normal, e);
    if (tau_n > 0.1) p.ambiguous = true;
    widen(scene, pose, surface.distance, tau_n, e, p);
    push(scene, surface.distance, pose.rotation * surface.normal, pose, p);
  }
}

class Substep {
 public:
  Substep(const Scene& scene, const ParticleState& state, const OracleAnswer& fields)
      : scene_(scene),
        state_(state),
        fields_(fields),
        solids_(scene.containers.begin(), scene.containers.end()) {
    for (const auto& c : scene.containers)
      poses_.push_back(pose_at(c, scene.time_at(state.substep + 1)));
  }

  /// One particle's substep with some undecidable contacts turned round.
  Particle run(Eigen::Index i, unsigned flips) const {
    const double dt = scene_.time_step();
    Particle p;
    p.flips = flips;
    const Vec3 a = fields_.fields.acceleration.col(i);
    p.v = state_.velocity.col(i) + dt * a;
    p.tau_v = dt * fields_.tolerance.acceleration.col(i) +
              2 * u * (state_.velocity.col(i).cwiseAbs() + dt * a.cwiseAbs());
    p.x = state_.position.col(i) + dt * p.v;
    p.tau_x = dt * p.tau_v + 2 * u * (state_.position.col(i).cwiseAbs() + dt * p.v.cwiseAbs());
    wrap(p);
    for (std::size_t c = 0; c < solids_.size(); ++c) contact(scene_, solids_[c], poses_[c], p);
    if (scene_.floor) {
      const double height = p.x.z() - scene_.floor->height;
      const double e = p.tau_x.z() + 4 * u * (std::abs(p.x.z()) + std::abs(scene_.floor->height));
      if (p.touches(height, scene_.contact_distance(), e)) {
        widen(scene_, Pose{}, height, 0, e, p);
        push(scene_, height, Vec3::UnitZ(), Pose{}, p);
      }
    }
    return p;
  }

 private:
  void wrap(Particle& p) const {
    for (int c = 0; c < 3; ++c) {
      if (!scene_.domain.periodic[c]) continue;
      const double low = scene_.domain.min[c], period = scene_.domain.max[c] - low;
      const double turns = (p.x[c] - low) / period;
      p.tau_x[c] += 4 * u * (period + std::abs(low));
      p.x[c] -= period * std::floor(turns);
    }
  }

  const Scene& scene_;
  const ParticleState& state_;
  const OracleAnswer& fields_;
  std::vector<SolidDistance> solids_;
  std::vector<Pose> poses_;
};

}  // namespace

SubstepAnswer substep_answer(const Scene& scene, const ParticleState& state,
                             const OracleAnswer& fields) {
  constexpr int most_open = 3;
  const Substep substep(scene, state, fields);
  const auto n = static_cast<std::size_t>(state.size());
  SubstepAnswer answer;
  answer.outcomes.resize(n);
  answer.ambiguous.assign(n, false);
  answer.most_ambiguous = state.size() / 50 + 10;
  for (std::size_t i = 0; i < n; ++i) {
    unsigned variants = 1;
    for (unsigned flips = 0; flips < variants; ++flips) {
      const Particle p = substep.run(static_cast<Eigen::Index>(i), flips);
      answer.outcomes[i].push_back({p.x, p.v, p.tau_x, p.tau_v});
      if (p.ambiguous || p.undecided > most_open) {
        answer.ambiguous[i] = true;
        answer.longest_push = std::max(answer.longest_push, p.pushed);
      }
      // Turning one contact round can open another further on.
      variants = std::max(variants, 1u << std::min(p.undecided, most_open));
    }
  }
  return answer;
}

}  // namespace decant
