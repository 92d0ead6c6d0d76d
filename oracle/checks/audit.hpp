/// \file
/// Where the water is, and whether it went through a wall: judged in double from positions and the
/// paths between two samples, in each container's own frame, never by a backend's collision code.
#pragma once

#include "reference/distance.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace decant {

/// Region of one particle. `source` is the first container that can move, `receiver` any other.
enum class Region : std::uint8_t { source, in_flight, receiver, spilled, lost };
inline constexpr std::array<const char*, 5> region_names = {"source", "in_flight", "receiver", "spilled", "lost"};

struct AuditResult {
  std::array<std::int64_t, 5> particles_at{};  // by Region; adds up to N
  std::array<double, 5> mass_at{};             // kg
  double deepest = 0;                          // m, largest penetration depth at the positions
  std::int64_t deepest_particle = -1;
  std::int64_t inside = 0;   // particles inside a solid
  std::int64_t crossed = 0;  // particles whose path since the last look leads through a wall
  std::int64_t first_crossed = -1;
  double kinetic_energy = 0, potential_energy = 0;  // J
  double max_speed = 0;                             // m/s
  std::vector<std::uint8_t> region;                 // N, Region of each particle
};

/// Samples one state after another.
class Audit {
 public:
  explicit Audit(const Scene& scene);

  /// \param state  later than the one looked at before; paths are followed from there
  AuditResult sample(const ParticleState& state);

 private:
  Scene scene_;
  std::vector<SolidDistance> solids_;
  Eigen::Matrix3Xd last_;  // 3×N, m, positions at the last look
  std::int64_t last_substep_ = 0;
};

}  // namespace decant
