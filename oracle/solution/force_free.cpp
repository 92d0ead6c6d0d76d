/// \file
/// Every term of the acceleration put out.
#include "oracle/solution/force_free.hpp"

namespace decant {

Scene force_free(const Scene& scene) {
  Scene s = scene;
  s.gravity.setZero();
  s.fluid.viscosity = s.fluid.wall_viscosity = 0;
  s.fluid.allow_tension = false;
  s.fluid.sound_speed = 1e-12;
  s.mass_ratio = 1e-6;
  s.fills.clear();
  return s;
}

}  // namespace decant
