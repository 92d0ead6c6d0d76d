/// \file
/// The tilt schedule and the rigid motion that follows from it.
#include "reference/pose.hpp"

namespace decant {

TiltAngle tilt_at(const Tilt& tilt, double time) {
  const auto& keys = tilt.keys;
  if (time <= keys.front().time) return {keys.front().angle, 0.0};
  for (std::size_t k = 1; k < keys.size(); ++k) {
    if (time >= keys[k].time) continue;
    const double span = keys[k].time - keys[k - 1].time;
    const double turn = keys[k].angle - keys[k - 1].angle;
    const double s = (time - keys[k - 1].time) / span;
    return {keys[k - 1].angle + turn * s * s * (3.0 - 2.0 * s), turn * 6.0 * s * (1.0 - s) / span};
  }
  return {keys.back().angle, 0.0};
}

Pose pose_at(const Container& container, double time) {
  Pose pose;
  pose.translation = container.origin;
  pose.surface_velocity = container.surface_velocity;
  if (!container.tilt) return pose;
  const Tilt& tilt = *container.tilt;
  const TiltAngle at = tilt_at(tilt, time);
  pose.rotation = Eigen::AngleAxisd(at.angle, tilt.axis).toRotationMatrix();
  pose.pivot = tilt.pivot;
  pose.translation = tilt.pivot + pose.rotation * (container.origin - tilt.pivot);
  pose.angular_velocity = at.rate * tilt.axis;
  pose.surface_velocity = pose.rotation * container.surface_velocity;
  return pose;
}

}  // namespace decant
