/// \file
/// Where a container is at time t and how it moves: scene data, handed to every side.
#pragma once

#include "reference/scene.hpp"

namespace decant {

/// Rigid placement: x_world = rotation · x_local + translation; a material point at x_world moves
/// with linear_velocity + angular_velocity × (x_world − pivot); its surface slides over it with
/// surface_velocity.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Vec3 translation = Vec3::Zero();       // m
  Vec3 pivot = Vec3::Zero();             // m, world
  Vec3 angular_velocity = Vec3::Zero();  // rad/s
  Vec3 surface_velocity = Vec3::Zero();  // m/s, world
  Vec3 linear_velocity = Vec3::Zero();   // m/s, of the pivot

  Vec3 to_world(const Vec3& local) const { return rotation * local + translation; }
  Vec3 to_local(const Vec3& world) const { return rotation.transpose() * (world - translation); }
  Vec3 velocity_at(const Vec3& world) const {
    return angular_velocity.cross(world - pivot) + (linear_velocity + surface_velocity);
  }
};

struct TiltAngle {
  double angle;  // rad
  double rate;   // rad/s, the analytic derivative of `angle`
};

/// Tilt at time t (s): smoothstep between neighboring keys, what goes on after them, and the
/// oscillation.
TiltAngle tilt_at(const Tilt& tilt, double time);

struct TranslationOffset {
  Vec3 offset;    // m
  Vec3 velocity;  // m/s, the analytic derivative of `offset`
};

/// Translation at time t (s), by the same rules.
TranslationOffset translation_at(const Translation& translation, double time);

/// Pose of a container at time t (s): tilted about its line, then translated.
Pose pose_at(const Container& container, double time);

/// True where the container can move at all; one whose surface alone runs does not.
inline bool moves(const Container& container) {
  return container.tilt.has_value() || container.translation.has_value();
}

}  // namespace decant
