/// \file
/// How far apart two runs of one fluid may be: measured on the oracle itself, perturbed at every
/// substep by amounts of fp32's rounding. A pour is chaotic; after some tens of substeps no bound on
/// single particles says anything, but the spread of an ensemble does.
#pragma once

#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <array>
#include <cstdint>

namespace decant {

/// Measures of the distance between two states; the first four over particles.
inline constexpr std::array<const char*, 5> divergence_names = {"rms_position", "p99_position", "rms_velocity",
                                                                "p99_velocity", "energy"};
inline constexpr std::array<const char*, 5> divergence_units = {"m", "m", "m/s", "m/s", "J"};
using Divergence = std::array<double, 5>;

/// |x_a − x_b| by the nearest image and |v_a − v_b|: root mean square and 99th percentile; |E_a − E_b|
/// of kinetic and potential energy. NaN anywhere makes all of them NaN. Same number of particles.
Divergence divergence(const Scene& scene, const ParticleState& a, const ParticleState& b);

/// Distances of `members` perturbed runs from the unperturbed one.
struct Ensemble {
  std::int64_t substeps = 0, members = 0;
  Divergence mean{}, deviation{};
};

/// The oracle's state `substeps` on, perturbed. Before every substep x_c and v_c of every particle are
/// multiplied by 1 + u r, u = 2⁻²⁴, r uniform in [−1, 1], and rounded to fp32, as a backend stores them;
/// so is the end. Once, so is every constant that fp32 rounds once for all: mass, sound speed,
/// viscosities, gravity, dt, and where walls and floor stand and from how far they push.
ParticleState run_perturbed(const Scene& scene, const Walls& walls, const ParticleState& start, std::int64_t substeps,
                            std::uint32_t seed);

/// Runs it, sequentially, members seeded with seed, seed + 1, ….
Ensemble run_ensemble(const Scene& scene, const Walls& walls, const ParticleState& start, std::int64_t substeps,
                      std::int64_t members, std::uint32_t seed = 1);

/// The oracle's own state `substeps` on.
ParticleState run_oracle(const Scene& scene, const Walls& walls, const ParticleState& start, std::int64_t substeps);

/// What a correct fp32 backend may be apart: 3 (mean + 6 deviations). The 3 is √9, the roundings of a
/// contact beside the one that a perturbation stands for.
Divergence divergence_bound(const Ensemble& ensemble);

}  // namespace decant
