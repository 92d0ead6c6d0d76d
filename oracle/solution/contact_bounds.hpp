/// \file
/// The oracle's move and contact of one particle with an error bound carried along. Contact is a
/// discontinuity: where fp32 cannot decide whether a particle touches, either way is an answer, each with
/// its own narrow bound.
#pragma once

#include "reference/distance.hpp"
#include "reference/pose.hpp"
#include "reference/scene.hpp"
#include "reference/shapes.hpp"

#include <vector>

namespace decant {

/// How far a vector may be from its own, both ways at once: by component, and as a length.
struct VectorBound {
  Vec3 components = Vec3::Zero();
  double length = 0;

  void add(const Vec3& more) {
    components += more;
    length += more.norm();
  }
  /// In any direction alike by so much.
  static VectorBound ball(double radius) { return {Vec3::Constant(radius), radius}; }
};

/// A particle, and how far a correct fp32 code may be from it.
struct BoundedParticle {
  Vec3 x, v;                 // m, m/s
  VectorBound tau_x, tau_v;  // m, m/s
  bool ambiguous = false;    // the nearest face cannot be told
  /// Contacts that fp32 cannot decide and that matter, so far; bit k of `flips` turns the k-th round.
  int undecided = 0;
  unsigned flips = 0;
  double pushed = 0;  // m, all pushes together

  /// Takes in what another answer to the same gives.
  void take_in(const BoundedParticle& other);
};

/// Undecidable contacts of one particle that are tried both ways; one with more is ambiguous.
inline constexpr int most_undecided = 3;

/// Calls run(flips), which returns a BoundedParticle, for the oracle's own decisions and then for each way
/// of deciding the undecidable ones; take(particle) gets each result.
template <class Run, class Take>
void each_decision(Run run, Take take) {
  unsigned variants = 1;
  for (unsigned flips = 0; flips < variants; ++flips) {
    const BoundedParticle p = run(flips);
    take(p);
    // Turning one contact round can open another further on.
    const int open = p.undecided < most_undecided ? p.undecided : most_undecided;
    if (variants < (1u << open)) variants = 1u << open;
  }
}

/// Bounds, u = 2⁻²⁴, first order; e restitution, f friction, k = (1 + e) f, phi_c the contact distance.
/// Legal forms: a pose as R x + t or as pivot + R (x − pivot), the lever of a wall's velocity from the
/// world's place or from the container's, the normal beside a face as the face's own or as the difference
/// from the nearest point; R, t, pivot, omega and the surface's velocity are each rounded to fp32 once.
///
///   epsilon   = u (2|t| + 16|x_local| + lever), lever = |pivot| + 8|x − pivot| + |t − pivot| where the
///               container turns: what pose and distance add to the distance from a wall
///   tau_n     = how far the normal turns within |tau_x| + epsilon, and 4u (1 + |x_local|/|phi|), and 8u
///               where the container turns
///   seam      = s/|phi| more, s = √(6u phi² + 8u |phi| X), where the nearest point is within
///               s + 2 (|tau_x| + epsilon) of the end of a face or edge: which of two is nearest is told by squares
///               of distances, each rounded by 3u, from a nearest point rounded by 4u X, X the largest among |l| and
///               the surface's coordinates; so that the nearest point of a neighbor s along may be taken
///   tau_x    <- |tau_x| + epsilon + (phi_c − phi)(tau_n + 2u) + 2u|x|: the way out cancels the error
///               along the normal. Lengths are carried on as lengths, not as a cube's diagonal
///   tau_wall  = |omega| (|tau_x| + 4u (|x| + |pivot| + |x − pivot|)) + 3u (|v_linear| + |v_surface| +
///               |v_wall|)
///   tau_v    <- (1 + k)|tau_v| + (2 + k) tau_wall + (2 + 2e + k)|w| tau_n + 8u (1 + e + k)|w| +
///               4u (|v_wall| + |v|), w the velocity relative to the wall; unchanged where w points away
///               from the wall by more than its own error. The response is continuous and piecewise
///               smooth in w, with a slope of 1 + k at most.
///
/// Contact within |tau_x| + epsilon of phi_c cannot be decided. What has just been pushed there is always such a
/// case, and nearly the same either way: where velocities, too, differ by tau_v at most, both ways are one answer,
/// with a bound that holds them both. Else each is an answer of its own.
class ContactBounds {
 public:
  explicit ContactBounds(const Scene& scene);

  /// v += dt a: tau_v += dt tau_a + 2u (|v| + dt|a|) + 3N, N = 2⁻¹²⁶. \param tau_a  m/s²
  void accelerate(const Vec3& a, const Vec3& tau_a, BoundedParticle& p) const;
  /// x += dt v, and back into the period: tau_x += dt tau_v + u (2|x| + 4 dt|v|) + 3N.
  void fly(BoundedParticle& p) const;
  /// Containers, where they stand, in the scene's order, and then the floor.
  /// \param poses  one a container
  void collide(const std::vector<Pose>& poses, BoundedParticle& p) const;

  /// \param time  s
  std::vector<Pose> poses_at(double time) const;
  const std::vector<SolidDistance>& solids() const { return solids_; }
  /// Surface of a container, in its frame: edges of a revolved one's outline, faces of another one.
  const std::vector<ProfileEdge>& edges(std::size_t container) const { return edges_[container]; }
  const std::vector<BoxFace>& faces(std::size_t container) const { return faces_[container]; }

 private:
  enum class Contact { none, certain, either };

  void contact(std::size_t container, const Pose& pose, BoundedParticle& p) const;
  /// Responds where there is contact at this distance, known within e. respond(particle)
  template <class Respond>
  Contact meet(double distance, double e, BoundedParticle& p, Respond respond) const;
  void respond_to(std::size_t container, const SurfaceDistance& surface, const Vec3& local, const Pose& pose,
                  double epsilon, BoundedParticle& p) const;
  /// \param epsilon  m; \param tau_n  of the normal
  void respond(double distance, const Vec3& normal, const Pose& pose, double epsilon, double tau_n,
               BoundedParticle& p) const;

  /// Whether a place of the container's surface (m, its frame) is within `width` (m) of where a face or an
  /// edge of its outline ends.
  bool near_seam(std::size_t container, const Vec3& place, double width) const;

  const Scene& scene_;
  std::vector<SolidDistance> solids_;
  std::vector<std::vector<ProfileEdge>> edges_;  // of revolved containers
  std::vector<std::vector<BoxFace>> faces_;      // of the others
  std::vector<double> extents_;                  // the surfaces' largest coordinates, m
};

}  // namespace decant
