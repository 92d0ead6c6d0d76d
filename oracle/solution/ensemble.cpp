/// \file
/// Perturbed runs and the distances between runs.
#include "oracle/solution/ensemble.hpp"

#include "reference/neighbors.hpp"
#include "reference/solver.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace decant {
namespace {

double energy(const Scene& scene, const ParticleState& s) {
  double sum = 0;
  for (Eigen::Index i = 0; i < s.size(); ++i)
    sum += 0.5 * s.velocity.col(i).squaredNorm() - scene.gravity.dot(s.position.col(i));
  return scene.particle_mass() * sum;
}

double rms(const std::vector<double>& lengths) {
  double sum = 0;
  for (const double d : lengths) sum += d * d;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, lengths.size())));
}

double percentile99(std::vector<double> lengths) {
  if (lengths.empty()) return 0;
  for (const double d : lengths)
    if (std::isnan(d)) return d;  // nth_element would lose it
  const auto at = lengths.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(lengths.size() - 1));
  std::nth_element(lengths.begin(), at, lengths.end());
  return *at;
}

class Perturbation {
 public:
  explicit Perturbation(std::uint32_t seed) : random_(seed) {}

  void of(double& value) { value *= 1 + 0x1p-24 * share_(random_); }
  void of(ParticleState& state) {
    for (auto* m : {&state.position, &state.velocity})
      for (double& value : m->reshaped()) of(value);
    state.quantise();
  }
  void of(Scene& scene) {
    of(scene.mass_ratio);
    of(scene.fluid.sound_speed);
    of(scene.fluid.viscosity);
    of(scene.fluid.wall_viscosity);
    for (double& g : scene.gravity) of(g);
    of(scene.schedule.end);
    of(scene.contact.distance_ratio);
    if (scene.floor) of(scene.floor->height);
    for (Container& c : scene.containers) {
      for (double& x : c.origin) of(x);
      if (c.translation) of(*c.translation);
    }
  }
  void of(Translation& translation) {
    for (TranslationKey& key : translation.keys)
      for (double& x : key.offset) of(x);
    for (double& v : translation.velocity) of(v);
    if (translation.oscillation)
      for (double& x : translation.oscillation->amplitude) of(x);
  }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> share_{-1, 1};
};

}  // namespace

Divergence divergence(const Scene& scene, const ParticleState& a, const ParticleState& b) {
  const Separation separation(scene.domain);
  std::vector<double> x, v;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    x.push_back(separation(Vec3(a.position.col(i)), Vec3(b.position.col(i))).norm());
    v.push_back((a.velocity.col(i) - b.velocity.col(i)).norm());
  }
  return {rms(x), percentile99(x), rms(v), percentile99(v), std::abs(energy(scene, a) - energy(scene, b))};
}

namespace {

ParticleState run_unperturbed(Solver solver, std::int64_t substeps) {
  for (std::int64_t k = 0; k < substeps; ++k) solver.substep();
  return solver.state();
}

/// A perturbation leaves the walls' volumes alone: V_b knows nothing but their own distances.
ParticleState run_perturbed(const Scene& scene, const Walls& walls, const Eigen::VectorXd& volumes,
                            const ParticleState& start, std::int64_t substeps, std::uint32_t seed) {
  Perturbation perturbation(seed);
  Scene its_scene = scene;
  perturbation.of(its_scene);
  Solver solver(its_scene, walls, start, volumes);
  ParticleState state = start;
  for (std::int64_t k = 0; k < substeps; ++k) {
    perturbation.of(state);
    solver.restart(state);
    solver.substep();
    state = solver.state();
  }
  state.quantise();
  return state;
}

}  // namespace

ParticleState run_oracle(const Scene& scene, const Walls& walls, const ParticleState& start, std::int64_t substeps) {
  return run_unperturbed(Solver(scene, walls, start), substeps);
}

ParticleState run_perturbed(const Scene& scene, const Walls& walls, const ParticleState& start, std::int64_t substeps,
                            std::uint32_t seed) {
  return run_perturbed(scene, walls, boundary_volumes<double>(scene, walls), start, substeps, seed);
}

Ensemble run_ensemble(const Scene& scene, const Walls& walls, const ParticleState& start, std::int64_t substeps,
                      std::int64_t members, std::uint32_t seed) {
  const Eigen::VectorXd volumes = boundary_volumes<double>(scene, walls);
  const ParticleState unperturbed = run_unperturbed(Solver(scene, walls, start, volumes), substeps);
  Ensemble e;
  e.substeps = substeps;
  e.members = members;
  std::vector<Divergence> all;
  for (std::int64_t m = 0; m < members; ++m)
    all.push_back(
        divergence(scene, run_perturbed(scene, walls, volumes, start, substeps, seed + static_cast<std::uint32_t>(m)),
                   unperturbed));
  const auto count = static_cast<double>(members);
  for (std::size_t k = 0; k < e.mean.size(); ++k) {
    for (const auto& d : all) e.mean[k] += d[k] / count;
    double squares = 0;
    for (const auto& d : all) squares += (d[k] - e.mean[k]) * (d[k] - e.mean[k]);
    e.deviation[k] = std::sqrt(squares / std::max(1.0, count - 1));
  }
  return e;
}

Divergence divergence_bound(const Ensemble& ensemble) {
  // A perturbation is one rounding of x and one of v. A backend in a contact makes about nine: x + dt v,
  // four to the container's frame, two of distance and normal, two of the push; they add in squares.
  constexpr double roundings = 3;
  Divergence bound{};
  for (std::size_t k = 0; k < bound.size(); ++k) bound[k] = roundings * (ensemble.mean[k] + 6 * ensemble.deviation[k]);
  return bound;
}

}  // namespace decant
