/// \file
/// decant.Scene: the constants of a scene with its motion and its solids, from a file or as a plug-in is given them.
#pragma once

#include "oracle/plugin/flat_scene.hpp"
#include "reference/scene.hpp"

#include <nanobind/nanobind.h>

#include <memory>
#include <optional>
#include <string>

namespace decant::package {

struct SceneType {
  decant_scene flat{};
  std::optional<Scene> whole;                 // of a file
  std::unique_ptr<SceneCallbacks> callbacks;  // of a file

  static SceneType of(Scene scene);
  /// Throws nanobind's ValueError where it is not of a file.
  const Scene& of_file() const;
};

void bind_scene(nanobind::module_& module);

}  // namespace decant::package
