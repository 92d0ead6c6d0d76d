/// \file
/// The part of check_scene that looks at the fluid: it fits its container, and touches no wall and
/// no other fluid.
#pragma once

#include "reference/scene.hpp"

#include <string>

namespace decant {

/// Throws InputError on the first fill that does not fit. The containers have passed their checks.
/// \param file  for messages
void check_fluid(const Scene& scene, const std::string& file);

}  // namespace decant
