/// \file
/// What a pour starts from where the command line changes it.
#include "reference/scene_checks.hpp"
#include "tools/pour/pour.hpp"

#include <random>

namespace decant::pour {

ParticleState perturbed_start(ParticleState state, std::uint32_t seed) {
  std::mt19937 random(seed);
  for (double& x : state.position.reshaped())
    x *= 1 + 0x1p-22 * (2.0 * static_cast<double>(random()) / 4294967295.0 - 1);
  state.quantise();
  return state;
}

Scene with_frames(Scene scene, int frames) {
  const std::int64_t substeps = std::int64_t{scene.schedule.frames} * scene.schedule.substeps_per_frame;
  scene.schedule.frames = frames;
  scene.schedule.substeps_per_frame =
      scene.schedule.substeps_derived ? substeps_for(scene) : static_cast<int>((substeps + frames - 1) / frames);
  return scene;
}

}  // namespace decant::pour
