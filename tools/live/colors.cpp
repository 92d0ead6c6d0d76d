/// \file
/// Scales that do not move from picture to picture, so that colors can be compared.
#include "tools/live/colors.hpp"

#include "reference/scene_checks.hpp"

#include <algorithm>
#include <limits>

namespace decant::live {

Colors scale_of(Quantity quantity, const Scene& scene) {
  const double density = scene.fluid.rest_density, speed = std::max(expected_max_speed(scene), 1e-9);
  switch (quantity) {
    case Quantity::density:
      return {quantity, {}, 0.95 * density, 1.05 * density};
    case Quantity::pressure:
      return {quantity, {}, 0, 0.5 * density * speed * speed};
    case Quantity::region:
      return {quantity, {}, 0, static_cast<double>(region_names.size() - 1)};
    case Quantity::speed:
      return {quantity, {}, 0, speed};
    case Quantity::score:
      break;
  }
  return {quantity, {}, 0, 1};
}

void color(Colors& colors, const ParticleState& state, const Results& results) {
  switch (colors.quantity) {
    case Quantity::speed:
      colors.values = state.velocity.colwise().norm().transpose();
      break;
    case Quantity::region:
      if (const auto& audit = results.audit)
        colors.values = Eigen::Map<const Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 1>>(
                            audit->region.data(), static_cast<Eigen::Index>(audit->region.size()))
                            .cast<double>();
      break;
    case Quantity::score:
      if (const auto& scores = results.scores; scores && scores->values.size() == state.size())
        colors.values = scores->values;
      break;
    case Quantity::density:
    case Quantity::pressure:
      break;
  }
  // After a failure there are no fields.
  if (colors.values.size() != state.size())
    colors.values.setConstant(state.size(), std::numeric_limits<double>::quiet_NaN());
}

}  // namespace decant::live
