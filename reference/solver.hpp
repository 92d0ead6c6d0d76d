/// \file
/// The oracle: fields at one state, and one substep onward. Sequential, in the order a reader would
/// sum by hand: neighbors by ascending id. Double precision decides; the same source in float gives
/// the error a plain sequential fp32 code would make.
#pragma once

#include "reference/distance.hpp"
#include "reference/neighbors.hpp"
#include "reference/pose.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <vector>

namespace decant {

/// All containers' wall particles in the world at one time.
struct PosedWalls {
  Eigen::Matrix3Xd position;  // 3×M, m
  Eigen::Matrix3Xd velocity;  // 3×M, m/s
};

/// Wall positions and velocities at time t (s), from each container's pose.
PosedWalls pose_walls(const Scene& scene, const Walls& walls, double time);

/// V_b = 1 / Σ_k W_bk over the wall particles k of the same container, itself included, m³; a rigid
/// container keeps it. Source: Akinci et al. 2012, eq. 4.
template <class Real>
Eigen::VectorXd boundary_volumes(const Scene& scene, const Walls& walls);

/// Wall particles within H of each other in one container, whose frame they stand still in.
struct WallNeighbors {
  Eigen::Matrix3Xd position;                    // 3×M, m, each in its container's frame
  std::vector<std::vector<std::int32_t>> near;  // M lists of b, ascending; self excluded
};
WallNeighbors find_wall_neighbors(const Scene& scene, const Walls& walls);

/// boundary_volumes, from neighbors found before.
template <class Real>
Eigen::VectorXd boundary_volumes(const Scene& scene, const WallNeighbors& neighbors);

/// All fields of a state (state.hpp), boundary volumes given.
/// \param volumes  M, m³; \param given  where it holds density or pressure, these are used for what
/// follows from them instead of the computed ones, which are returned all the same
template <class Real>
void evaluate(const Scene& scene, const ParticleState& state, const PosedWalls& walls, const Eigen::VectorXd& volumes,
              const Neighbors& neighbors, Fields& out, const StageInputs* given = nullptr);

/// One projection of one particle out to the contact distance phi_c, where the approaching part of
/// its velocity relative to the wall is taken. Returns false where there is no contact.
///
/// Where phi < phi_c: x += (phi_c − phi) n; w = v − v_wall(x); if w·n < 0, with j = (1 + e)|w·n|:
/// normal part += j n, tangential part × max(0, 1 − f j/|w_t|).
/// \param distance  phi, m; \param normal  n, world; \param x  m, \param v  m/s, world, changed
bool push_out(const Scene& scene, double distance, const Vec3& normal, const Pose& pose, Vec3& x, Vec3& v);

/// Every particle out of the containers (in the scene's order, at most two projections each,
/// nearest face first) and then off the floor. \param time  s, at which the containers stand
void collide(const Scene& scene, const std::vector<SolidDistance>& solids, double time, ParticleState& state);

/// A scene under way.
class Solver {
 public:
  Solver(const Scene& scene, const Walls& walls, const ParticleState& state,
         NeighborSearch search = NeighborSearch::cells);
  /// \param volumes  boundary_volumes of the walls, M, m³
  Solver(const Scene& scene, const Walls& walls, const ParticleState& state, const Eigen::VectorXd& volumes,
         NeighborSearch search = NeighborSearch::cells);

  /// Fields at the present state.
  void fields(Fields& out, const StageInputs* given = nullptr);
  /// Semi-implicit Euler: v += a dt, x += v dt, wrap, collide at t + dt.
  void substep();

  /// From another state of the same number of particles.
  void restart(const ParticleState& state) { state_ = state; }

  const ParticleState& state() const { return state_; }
  const Neighbors& neighbors() const { return neighbors_; }
  const Eigen::VectorXd& volumes() const { return volumes_; }

 private:
  Scene scene_;
  Walls walls_;
  ParticleState state_;
  NeighborSearch search_;
  std::vector<SolidDistance> solids_;
  Eigen::VectorXd volumes_;
  Neighbors neighbors_;
  Fields fields_;
};

}  // namespace decant
