/// \file
/// Positions over the domain, values over their scale, both in 16 bits.
#include "tools/live/picture.hpp"

#include "reference/pose.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace decant::live {
namespace {

static_assert(std::endian::native == std::endian::little);

// 65535 over the extent; NaN becomes 0.
std::uint16_t step_of(double fraction) {
  return static_cast<std::uint16_t>(fraction > 0 ? std::min(fraction, 1.0) * 65535.0 + 0.5 : 0.0);
}

}  // namespace

Message picture_of(const Scene& scene, const ParticleState& state, const Colors& colors) {
  const Vec3 extent = scene.domain.max - scene.domain.min;
  std::vector<double> head = {1.0,
                              static_cast<double>(state.size()),
                              static_cast<double>(scene.containers.size()),
                              static_cast<double>(state.substep),
                              scene.time_at(state.substep),
                              static_cast<double>(colors.quantity),
                              colors.least,
                              colors.largest};
  for (const Vec3& v : {scene.domain.min, extent}) head.insert(head.end(), v.begin(), v.end());
  for (const Container& container : scene.containers) {
    const Pose pose = pose_at(container, scene.time_at(state.substep));
    for (Eigen::Index row = 0; row < 3; ++row)
      for (Eigen::Index column = 0; column < 3; ++column) head.push_back(pose.rotation(row, column));
    head.insert(head.end(), pose.translation.begin(), pose.translation.end());
  }

  const auto n = static_cast<std::size_t>(state.size());
  auto bytes = std::make_shared<std::string>();
  bytes->resize(head.size() * sizeof(double) + n * 4 * sizeof(std::uint16_t));
  std::memcpy(bytes->data(), head.data(), head.size() * sizeof(double));
  char* out = bytes->data() + head.size() * sizeof(double);
  const Vec3 scale = extent.cwiseInverse();
  const double range = colors.largest - colors.least;
  for (Eigen::Index i = 0; i < state.size(); ++i) {
    const Vec3 place = (state.position.col(i) - scene.domain.min).cwiseProduct(scale);
    const std::array<std::uint16_t, 4> four = {step_of(place.x()), step_of(place.y()), step_of(place.z()),
                                               step_of((colors.values[i] - colors.least) / range)};
    std::memcpy(out, four.data(), sizeof four);
    out += sizeof four;
  }
  return bytes;
}

}  // namespace decant::live
