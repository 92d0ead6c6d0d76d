/// \file
/// A recorded state with the oracle's answer to it: what every backend is judged on. The file's
/// layout is in formats/fixture.md.
#pragma once

#include "oracle/ensemble.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace decant {

/// Condition sums, in double, from the oracle's own loop (oracle/tolerance.hpp says what each
/// bounds). N, or 3×N by component.
struct ConditionSums {
  Eigen::VectorXd density;                 // Σ m (W + r|W'|) + Σ rho0 V_b (W + r|W'|), kg/m³
  Eigen::VectorXd density_pose;            // Σ rho0 V_b |W'| X_b, kg/m³
  Eigen::Matrix3Xd pressure_acceleration;  // Σ |t| (1 + r|G'|/G), m/s²
  Eigen::Matrix3Xd viscous_acceleration;
  Eigen::Matrix3Xd wall_pressure_acceleration;
  Eigen::Matrix3Xd wall_viscous_acceleration;
};

/// Schema version of fixture files; a reader refuses any other.
inline constexpr std::int64_t fixture_schema = 2;

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

/// Throws InputError naming file, dataset and what is wrong: truncated, wrong version, missing
/// group, wrong shape, NaN or non-fp32 state, a scene that does not parse, walls sampled otherwise
/// than when the fixture was recorded.
Fixture read_fixture(const std::filesystem::path& file);

/// Writes aside, then renames. With `fields` everything is stored, without them the sample. Throws
/// std::runtime_error naming file and dataset where the fixture is one that read_fixture would
/// refuse, or where writing fails.
void write_fixture(const std::filesystem::path& file, const Fixture& fixture);

/// Replaces fields and condition sums by their digest and the values of `count` particles spread
/// evenly over the ids. Throws std::invalid_argument where the fixture holds no fields.
void reduce_to_sample(Fixture& fixture, Eigen::Index count = 1024);

/// Hexadecimal SHA-256 over all fields rounded to fp32, integers as int64, in the order of
/// formats/fixture.md. Equal digests mean equal fields; unequal ones may also come from another
/// compiler's last bits, then the sample decides.
std::string digest_of(const Fields& fields);

/// Hexadecimal SHA-256 over every container's wall count (uint64) and positions (fp32, x y z).
std::string digest_of(const Walls& walls);

/// Hexadecimal SHA-256 of a text.
std::string sha256_of_text(std::string_view text);
/// Hexadecimal SHA-256 of a file's bytes. Throws InputError where it cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

}  // namespace decant
