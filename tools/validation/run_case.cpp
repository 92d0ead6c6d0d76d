/// \file
/// A case's run: scene at its resolution, backend frame by frame, observer at every frame.
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "reference/scene_checks.hpp"
#include "reference/scene_file.hpp"
#include "tools/validation/validation.hpp"

#include <chrono>

namespace decant::validate {

bool Result::passed() const {
  for (const auto& quantity : quantities)
    if (!quantity.met()) return false;
  return true;
}

Quantity& Result::add(Quantity quantity) { return quantities.emplace_back(std::move(quantity)); }

Scene scene_of(const Case& which, int resolution, const std::filesystem::path& scenes) {
  const auto file = scenes / which.scene;
  Scene scene = load_scene(file);
  scene.particle_spacing = which.length / resolution;
  if (scene.schedule.substeps_derived) scene.schedule.substeps_per_frame = substeps_for(scene);
  (void)check_scene(scene, file.string());
  return scene;
}

namespace {

void require_ok(const Backend& backend, const Status& status) {
  if (!status.ok()) throw BackendError(backend.info().name + ": " + describe(status));
}

}  // namespace

Result run(const Case& which, int resolution, const Scene& scene, Backend& backend,
           const std::filesystem::path& experiments, const std::function<void(int)>& frame_done) {
  const Walls walls = sample_walls(scene);
  ParticleState state = initial_state(scene);
  Result result;
  result.name = which.name;
  result.source = which.source;
  result.resolution = resolution;
  result.particle_spacing = scene.particle_spacing;
  result.particles = state.size();
  result.wall_particles = walls.size();
  result.backend = backend.info();
  const auto observer = which.observe({scene, walls, resolution, result.backend.precision == "fp32", experiments});
  backend.load(scene, walls, state);
  const auto start = std::chrono::steady_clock::now();
  for (int frame = 0; frame <= scene.schedule.frames; ++frame) {
    if (frame > 0) {
      require_ok(backend, backend.advance(scene.schedule.substeps_per_frame));
      backend.read(state);
    }
    Fields fields = Fields::unwritten(state.size(), walls.size());
    require_ok(backend, backend.evaluate(fields));
    if (!state.position.allFinite() || !state.velocity.allFinite() || !fields.density.allFinite() ||
        !fields.pressure.allFinite())
      require_ok(backend, {Status::non_finite, -1, state.substep});
    observer->sample({scene.time_at(state.substep), state, fields});
    if (frame_done) frame_done(frame);
  }
  result.solver_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.substeps = state.substep;
  result.simulated_seconds = scene.time_at(state.substep);
  observer->finish(result);
  return result;
}

std::vector<ObservedOrder> observed_orders(const std::vector<Result>& results) {
  std::vector<ObservedOrder> orders;
  for (std::size_t k = 0; k < results.size(); ++k) {
    const Result& fine = results[k];
    const Result* coarse = nullptr;  // the next coarser one of the same case and backend
    for (const auto& other : results)
      if (other.name == fine.name && other.backend.name == fine.backend.name &&
          other.backend.options == fine.backend.options && other.resolution < fine.resolution &&
          (!coarse || other.resolution > coarse->resolution))
        coarse = &other;
    if (!coarse) continue;
    for (const auto& quantity : fine.quantities)
      for (const auto& before : coarse->quantities)
        if (before.name == quantity.name && before.error > 0 && quantity.error > 0)
          orders.push_back({fine.name, quantity.name, coarse->resolution, fine.resolution,
                            std::log(before.error / quantity.error) /
                                std::log(static_cast<double>(fine.resolution) / coarse->resolution)});
  }
  return orders;
}

}  // namespace decant::validate
