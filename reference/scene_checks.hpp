/// \file
/// What a scene checks on itself before any work, and the numbers that follow from dx by rule.
#pragma once

#include "reference/scene.hpp"

#include <string>
#include <vector>

namespace decant {

/// Highest speed to expect, m/s: `schedule.max_speed` where given, else the greatest
/// sqrt(v0² + 2 g Δ) of any fill. v0 is its first speed, or that of the fastest wall, whatever that holds;
/// Δ the fall from the highest point that the initial fluid can be carried to over the tilt down to
/// the floor (or, without a floor, to the lowest cavity bottom, or the domain). Throws InputError
/// where gravity pulls along a periodic axis and no `max_speed` is given.
double expected_max_speed(const Scene& scene);

/// Longest allowed substep, s: the smaller of courant · h / (c0 + v_max) and the viscous limit
/// 0.125 h² rho0 / max(mu, mu_w/2). Sources: Monaghan 1992; Morris et al. 1997.
/// \param max_speed  m/s, v_max
double longest_time_step(const Scene& scene, double courant, double max_speed);

/// Fewest substeps a frame that the CFL and the viscous limit allow. Throws InputError as
/// expected_max_speed does, and where the number passes 1e9.
int substeps_for(const Scene& scene);

/// The scene with dx chosen so that it holds about `particles` particles: as near as whole lattice
/// layers allow, which is about 3 % at 4,000 in a cup, 1 % at 56,000, and less beyond. Substeps are
/// derived anew unless the scene sets them; all else is kept or follows from dx by rule. The result
/// is unchecked: call check_scene. Throws InputError.
Scene with_particles(Scene scene, std::int64_t particles);

/// What was checked before: containers that are as they were, and move as they did, keep their distances, whatever
/// became of the fluid. To look for the least one takes seconds where boxes turn.
enum class Distances { unknown, known };

/// Throws InputError on the first violated condition; returns warnings. \param file for messages.
std::vector<std::string> check_scene(const Scene& scene, const std::string& file,
                                     Distances distances = Distances::unknown);

}  // namespace decant
