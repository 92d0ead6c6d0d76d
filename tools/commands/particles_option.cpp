/// \file
/// An estimate of memory, and a search for the coarsest spacing that a scene bears.
#include "tools/commands/particles_option.hpp"

#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/scene_checks.hpp"

#include <fmt/format.h>

#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>

namespace decant {
namespace {

[[noreturn]] void refuse(std::int64_t particles, const std::string& bound) {
  throw InputError("command line", "--particles", std::to_string(particles), bound);
}

/// The scene with so many where that holds; what is wrong otherwise.
std::optional<Scene> attempt(const Scene& scene, std::int64_t particles, const std::string& file, std::string& why) {
  try {
    Scene other = with_particles(scene, particles);
    (void)check_scene(other, file);
    return other;
  } catch (const InputError& error) {
    why = error.key() + " = " + error.value() + ": " + error.bound();
  } catch (const std::runtime_error& error) {
    why = error.what();
  }
  return {};
}

/// Fewest particles that an attempt succeeds with, found from a number that does and one that does not;
/// within 1 %.
std::int64_t fewest(const Scene& scene, std::int64_t too_few, std::int64_t enough, const std::string& file) {
  std::string ignored;
  while (static_cast<double>(enough) > 1.01 * static_cast<double>(too_few) + 1) {
    const auto middle =
        static_cast<std::int64_t>(std::sqrt(static_cast<double>(too_few) * static_cast<double>(enough)));
    (attempt(scene, middle, file, ignored) ? enough : too_few) = middle;
  }
  return enough;
}

}  // namespace

double memory_of_machine() {
  double bytes = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  double limit = 0;  // "max" reads as none
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> limit && limit > 0) bytes = std::min(bytes, limit);
  return bytes;
}

Scene with_asked_particles(const Scene& scene, std::int64_t particles, const std::string& file, double memory) {
  const std::int64_t most = 1'000'000'000;
  if (particles < 1 || particles > most) refuse(particles, fmt::format("must be 1 … {}", most));
  if (const double needed = host_bytes_per_particle * static_cast<double>(particles); needed > memory)
    refuse(particles, fmt::format("at most {:.3g}: a particle takes {:g} bytes or more, {:.0f} GB in all, and "
                                  "this machine has {:.0f} GB",
                                  std::floor(memory / host_bytes_per_particle), host_bytes_per_particle, 1e-9 * needed,
                                  1e-9 * memory));
  std::string why;
  if (const auto found = attempt(scene, particles, file, why)) return *found;
  const std::int64_t own = initial_state(scene).size();
  if (particles >= own) refuse(particles, "a number that the scene bears: " + why);
  refuse(particles, fmt::format("at least {}; with fewer {}", fewest(scene, particles, own, file), why));
}

}  // namespace decant
