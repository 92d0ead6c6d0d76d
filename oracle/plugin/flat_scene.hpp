/// \file
/// A scene as plug-ins are given it (oracle/plugin.h).
#pragma once

#include "oracle/plugin.h"
#include "reference/distance.hpp"
#include "reference/scene.hpp"

#include <vector>

namespace decant {

/// All constants; no callbacks.
decant_scene flat_scene(const Scene& scene);

/// What its callbacks need: how containers move, and where their solids are.
class SceneCallbacks {
 public:
  SceneCallbacks() = default;
  explicit SceneCallbacks(std::vector<Container> containers);
  /// Sets the callbacks; valid as long as this stays where it is.
  void attach(decant_scene& scene) const;

 private:
  std::vector<Container> containers_;
  std::vector<SolidDistance> solids_;
};

}  // namespace decant
