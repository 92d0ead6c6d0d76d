/// \file
/// What the fluid is at one instant, and what is derived from it. Column i is particle i for life;
/// a 3×N column-major matrix is byte-identical to an HDF5 [N,3] dataset.
#pragma once

#include <Eigen/Dense>

#include <cstdint>
#include <limits>
#include <vector>

namespace decant {

using IdVector = Eigen::Matrix<std::int64_t, Eigen::Dynamic, 1>;

struct ParticleState {
  std::int64_t substep = 0;   // time is scene.time_at(substep)
  Eigen::Matrix3Xd position;  // 3×N, m
  Eigen::Matrix3Xd velocity;  // 3×N, m/s

  Eigen::Index size() const { return position.cols(); }

  /// Rounds positions and velocities to fp32, as every recorded and every initial state is, so
  /// that a backend in single precision starts from the same numbers as the oracle.
  void quantise() {
    position = position.cast<float>().cast<double>().eval();
    velocity = velocity.cast<float>().cast<double>().eval();
  }
};

/// Wall particles of one container, sampled once in its frame; coordinates are fp32-representable.
struct BoundaryParticles {
  Eigen::Matrix3Xd position;  // 3×M, m, container frame
};

/// One entry a container, in the scene's order. A wall particle's id counts through all of them.
struct Walls {
  std::vector<BoundaryParticles> containers;

  Eigen::Index size() const {
    Eigen::Index n = 0;
    for (const auto& c : containers) n += c.position.cols();
    return n;
  }
};

/// Fields derived from one ParticleState; never clamped in place. Self is not a neighbor here.
struct Fields {
  Eigen::VectorXd boundary_volume;         // M, m³
  Eigen::VectorXd density;                 // N, kg/m³
  Eigen::VectorXd pressure;                // N, Pa
  Eigen::Matrix3Xd acceleration;           // 3×N, m/s², the sum of the four parts below and gravity
  Eigen::Matrix3Xd pressure_acceleration;  // fluid on fluid
  Eigen::Matrix3Xd viscous_acceleration;   // fluid on fluid
  Eigen::Matrix3Xd wall_pressure_acceleration;
  Eigen::Matrix3Xd wall_viscous_acceleration;
  IdVector fluid_neighbor_count, fluid_neighbor_id_sum;  // N
  IdVector wall_neighbor_count, wall_neighbor_id_sum;    // N

  /// Fields as a backend receives them: reals NaN, integers −1, so that what it does not write shows.
  static Fields unwritten(Eigen::Index fluid, Eigen::Index wall) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Fields f;
    f.boundary_volume.setConstant(wall, nan);
    f.density.setConstant(fluid, nan);
    f.pressure.setConstant(fluid, nan);
    for (auto* a : {&f.acceleration, &f.pressure_acceleration, &f.viscous_acceleration, &f.wall_pressure_acceleration,
                    &f.wall_viscous_acceleration})
      a->setConstant(3, fluid, nan);
    for (auto* c : {&f.fluid_neighbor_count, &f.fluid_neighbor_id_sum, &f.wall_neighbor_count, &f.wall_neighbor_id_sum})
      c->setConstant(fluid, -1);
    return f;
  }
};

/// Inputs of later stages as the oracle has them, rounded to fp32; an empty member is not given. Pressure
/// comes with density; density alone gives the pressure that follows. Lets stages be judged one by one.
struct StageInputs {
  Eigen::VectorXd boundary_volume;  // M, m³
  Eigen::VectorXd density;          // N, kg/m³
  Eigen::VectorXd pressure;         // N, Pa
};

}  // namespace decant
