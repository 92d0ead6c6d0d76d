/// \file
/// The sequential solver with a fault put in: what it is told, what it finds, or what it hands back
/// is edited on the way. Whatever the edit does not touch is exact, so that a check which fails has
/// seen the edit.
#pragma once

#include "oracle/backend.hpp"
#include "reference/solver.hpp"

#include <functional>

namespace decant::test {

struct Edit {
  std::function<void(Scene&, ParticleState&)> loaded = [](Scene&, ParticleState&) {};
  std::function<void(const Scene&, Neighbors&, Eigen::VectorXd& volumes)> found = [](const Scene&, Neighbors&,
                                                                                     Eigen::VectorXd&) {};
  std::function<void(const Scene&, Fields&)> evaluated = [](const Scene&, Fields&) {};
  std::function<void(ParticleState&)> advanced = [](ParticleState&) {};
};

class EditedReference : public Backend {
 public:
  explicit EditedReference(Edit edit) : edit_(std::move(edit)) {}

  BackendInfo info() const override { return {"edited", "", "host", "1 CPU core", "fp64"}; }

  void load(const Scene& scene, const Walls& walls, const ParticleState& state) override {
    scene_ = scene;
    walls_ = walls;
    state_ = state;
    edit_.loaded(scene_, state_);
  }

  Status evaluate(Fields& out, const StageInputs* given) override {
    // Cells cannot be found for a position that is no number.
    if (const Status status = trouble(); status.bits & Status::non_finite) return status;
    const PosedWalls posed = pose_walls(scene_, walls_, scene_.time_at(state_.substep));
    Eigen::VectorXd volumes = boundary_volumes<double>(scene_, walls_);
    Neighbors near;
    find_neighbors(scene_, state_.position, posed.position, NeighborSearch::cells, near);
    edit_.found(scene_, near, volumes);
    decant::evaluate<double>(scene_, state_, posed, volumes, near, out, given);
    edit_.evaluated(scene_, out);
    return {};
  }

  Status advance(int substeps) override {
    const std::vector<SolidDistance> solids(scene_.containers.begin(), scene_.containers.end());
    Fields fields;
    if (Status status = trouble(); status.bits & Status::non_finite) {
      ++status.substep;
      return status;
    }
    for (int k = 0; k < substeps; ++k) {
      (void)evaluate(fields, nullptr);
      const double dt = scene_.time_step();
      state_.velocity += dt * fields.acceleration;
      state_.position += dt * state_.velocity;
      ++state_.substep;
      collide(scene_, solids, scene_.time_at(state_.substep), state_);
      if (const Status status = trouble(); !status.ok()) return status;
      edit_.advanced(state_);
    }
    return {};
  }

  void read(ParticleState& out) const override { out = state_; }
  StageTimes stage_times() const override { return {}; }
  NeighborStats neighbor_stats() const override { return {}; }

 private:
  /// Of the solver itself: what an edit makes of its results is for checks to find.
  Status trouble() const {
    for (Eigen::Index i = 0; i < state_.size(); ++i) {
      if (!state_.position.col(i).allFinite() || !state_.velocity.col(i).allFinite())
        return {Status::non_finite, i, state_.substep};
      if ((state_.position.col(i).array() < scene_.domain.min.array()).any() ||
          (state_.position.col(i).array() > scene_.domain.max.array()).any())
        return {Status::escaped, i, state_.substep};
    }
    return {};
  }

  Edit edit_;
  Scene scene_;
  Walls walls_;
  ParticleState state_;
};

}  // namespace decant::test
