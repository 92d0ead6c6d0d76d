/// \file
/// A recorded state with the oracle's answer to it: what every backend is judged on.
#pragma once

#include "oracle/solution/ensemble.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <map>
#include <optional>
#include <string>

namespace decant {

/// Condition sums, in double, from the oracle's own loop (oracle/solution/tolerance.hpp says what each
/// bounds). N, or 3×N by component.
struct ConditionSums {
  Eigen::VectorXd density;                 // Σ m (W + r|W'|) + Σ rho0 V_b (W + r|W'|), kg/m³
  Eigen::VectorXd density_pose;            // Σ rho0 V_b |W'| X_b, kg/m³
  Eigen::Matrix3Xd pressure_acceleration;  // Σ |t| (1 + r|G'|/G), m/s²
  Eigen::Matrix3Xd viscous_acceleration;
  Eigen::Matrix3Xd wall_pressure_acceleration;
  Eigen::Matrix3Xd wall_viscous_acceleration;
};

struct Fixture {
  std::string name;    // file name without ".h5", filled by read_fixture
  std::string phase;   // "settled", "tilt-onset", "stream", "splash", "filling", "rest", …
  std::string sha256;  // of the file, filled by read_fixture
  Scene scene;
  ParticleState state;  // fp32-representable
  /// The oracle's answer; absent in study-scale fixtures, which hold a digest and a sample of it.
  std::optional<Fields> fields;
  std::optional<ConditionSums> condition;
  /// Study scale: ids of the sampled particles, ascending, and their density, pressure and
  /// acceleration.
  IdVector sample_id;
  Eigen::VectorXd sample_density, sample_pressure;
  Eigen::Matrix3Xd sample_acceleration;
  std::string fields_digest;  // study scale: digest_of of all fields
  Ensemble ensemble;          // of perturbed runs from here on
  /// version, compiler, flags, …; scene_sha256 is set by write_fixture.
  std::map<std::string, std::string> provenance;

  bool study_scale() const { return !fields.has_value(); }
};

/// Replaces fields and condition sums by their digest and the values of `count` particles spread
/// evenly over the ids. Throws std::invalid_argument where the fixture holds no fields.
void reduce_to_sample(Fixture& fixture, Eigen::Index count = 1024);

}  // namespace decant
