/// \file
/// One instant as the page receives it: 8 bytes a particle, so that a million particles are 8 MB.
///
/// Bytes, little-endian; the numbers before the particles are 8 bytes each, so that a page reads them in place:
///   double  version (1), N, containers C, substep, time (s), quantity (index in quantity_names), least, largest value
///   double  box: min x, y, z, extent x, y, z (m)
///   double  C × 12: a container's rotation, row by row, and its translation (m)
///   uint16  N × 4: x, y, z over the box, the value between least and largest, both as 0 … 65535
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace decant::live {

/// What particles are colored by.
enum class Quantity : std::uint8_t { speed, density, pressure, region, score };
inline constexpr std::array<const char*, 5> quantity_names = {"speed", "density", "pressure", "region", "score"};

/// The values that particles are colored by.
struct Colors {
  Quantity quantity = Quantity::speed;
  Eigen::VectorXd values;         // N; no number: none is known
  double least = 0, largest = 0;  // the ends of the scale, in the values' unit
};

using Message = std::shared_ptr<const std::string>;

/// The bytes above. A position outside the domain is drawn at its edge; a value beyond the scale, or none, at its end.
Message picture_of(const Scene& scene, const ParticleState& state, const Colors& colors);

}  // namespace decant::live
