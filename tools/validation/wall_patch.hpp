/// \file
/// Pressure on a part of a wall, from the reaction of its particles.
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <vector>

namespace decant::validate {

/// Wall particles in a box, of a container that does not move.
class WallPatch {
 public:
  /// \param box  m, world; takes in the wall particles behind one flat face
  /// \param normal  unit, from the fluid into the wall
  /// Throws std::runtime_error where the box holds fewer than 2 × 2 particles of the face.
  WallPatch(const Scene& scene, const Walls& walls, const SolidBox& box, const Vec3& normal);

  /// Force of the fluid on the patch's particles along the normal, over its area, Pa:
  ///   p = −(1/A) Σ_b Σ_i m rho0 V_b (p_i/rho_i²) G_ib x_ib·n
  /// the reaction to the wall pressure of pair_terms.hpp. Pushes at the contact distance are not in it.
  double pressure(const ParticleState& state, const Fields& fields) const;

  double area() const { return area_; }  // m², rows × columns of the face's particles

 private:
  Scene scene_;
  Vec3 normal_, low_, high_;  // m, of the particles
  Eigen::Matrix3Xd position_;
  std::vector<Eigen::Index> ids_;
  double area_ = 0;
};

}  // namespace decant::validate
