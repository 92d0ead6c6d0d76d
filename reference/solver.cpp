/// \file
/// One substep: integrate, wrap, push out of the containers as they stand at its end.
#include "reference/solver.hpp"

namespace decant {

bool push_out(const Scene& scene, double distance, const Vec3& normal, const Pose& pose, Vec3& x, Vec3& v) {
  const double reach = scene.contact_distance();
  if (!(distance < reach)) return false;
  x += (reach - distance) * normal;
  const Vec3 v_wall = pose.velocity_at(x);
  const Vec3 w = v - v_wall;
  const double approach = w.dot(normal);
  if (!(approach < 0)) return true;
  const double j = (1 + scene.contact.restitution) * -approach;
  const Vec3 tangential = w - approach * normal;
  const double slip = tangential.norm();
  const double keep = slip > 0 ? std::max(0.0, 1 - scene.contact.friction * j / slip) : 0.0;
  v = v_wall + (approach + j) * normal + keep * tangential;
  return true;
}

void collide(const Scene& scene, const std::vector<SolidDistance>& solids, double time, ParticleState& state) {
  // Containers' order is kept, though no state shows it: they are H >= 1.5 dx apart, and whoever is pushed
  // ends within the contact distance of that surface, dx/2 at most, so that it is dx at least from any other.
  for (std::size_t c = 0; c < solids.size(); ++c) {
    const Pose pose = pose_at(scene.containers[c], time);
    for (Eigen::Index i = 0; i < state.size(); ++i) {
      Vec3 x = state.position.col(i), v = state.velocity.col(i);
      for (int projection = 0; projection < 2; ++projection) {
        const Vec3 local = pose.to_local(x);
        if (!solids[c].may_be_within(scene.contact_distance(), local)) break;
        const SurfaceDistance surface = solids[c].at(local);
        if (!push_out(scene, surface.distance, pose.rotation * surface.normal, pose, x, v)) break;
      }
      state.position.col(i) = x;
      state.velocity.col(i) = v;
    }
  }
  if (!scene.floor) return;
  for (Eigen::Index i = 0; i < state.size(); ++i) {
    Vec3 x = state.position.col(i), v = state.velocity.col(i);
    push_out(scene, x.z() - scene.floor->height, Vec3::UnitZ(), Pose{}, x, v);
    state.position.col(i) = x;
    state.velocity.col(i) = v;
  }
}

Solver::Solver(const Scene& scene, const Walls& walls, const ParticleState& state, NeighborSearch search)
    : Solver(scene, walls, state, boundary_volumes<double>(scene, walls), search) {}

Solver::Solver(const Scene& scene, const Walls& walls, const ParticleState& state, const Eigen::VectorXd& volumes,
               NeighborSearch search)
    : scene_(scene),
      walls_(walls),
      state_(state),
      search_(search),
      solids_(scene.containers.begin(), scene.containers.end()),
      volumes_(volumes) {}

void Solver::fields(Fields& out, const StageInputs* given) {
  const PosedWalls posed = pose_walls(scene_, walls_, scene_.time_at(state_.substep));
  find_neighbors(scene_, state_.position, posed.position, search_, neighbors_);
  const bool own_volumes = !given || given->boundary_volume.size() == 0;
  evaluate<double>(scene_, state_, posed, own_volumes ? volumes_ : given->boundary_volume, neighbors_, out, given);
  out.boundary_volume = volumes_;
}

void Solver::substep() {
  fields(fields_);
  const double dt = scene_.time_step();
  state_.velocity += dt * fields_.acceleration;
  state_.position += dt * state_.velocity;
  for (int a = 0; a < 3; ++a) {
    if (!scene_.domain.periodic[a]) continue;
    const double low = scene_.domain.min[a], period = scene_.domain.max[a] - low;
    for (Eigen::Index i = 0; i < state_.size(); ++i) {
      double& x = state_.position(a, i);
      x -= period * std::floor((x - low) / period);
    }
  }
  ++state_.substep;
  collide(scene_, solids_, scene_.time_at(state_.substep), state_);
}

}  // namespace decant
