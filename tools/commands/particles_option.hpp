/// \file
/// --particles: how many a scene can be asked for.
#pragma once

#include "reference/scene.hpp"

#include <cstdint>
#include <string>

namespace decant {

/// Bytes of memory that a particle of a run takes on the host at least: states, fields and a frame.
inline constexpr double host_bytes_per_particle = 500;

/// Bytes that this process may have: the machine's memory, or less where its control group says so.
double memory_of_machine();

/// The scene with about `particles` particles, checked. Throws InputError naming --particles: where they
/// cannot be held in this machine's memory, before any are made, and where the scene's walls and gaps need
/// a finer spacing than so few give, with the fewest that fit.
/// \param scene  checked as it is; \param file  for messages; \param memory  bytes that there are
Scene with_asked_particles(const Scene& scene, std::int64_t particles, const std::string& file,
                           double memory = memory_of_machine());

}  // namespace decant
