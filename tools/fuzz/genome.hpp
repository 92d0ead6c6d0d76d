/// \file
/// A fuzzed problem as whole numbers: a small scene and a state in it, positions and velocities on
/// lattices, so that faces of cells, coincidences and exact distances come up, and so that shrinking
/// has somewhere to go: every number may come nearer to 0, every particle may leave.
///
/// Legend: dx particle spacing, H support radius, c0 sound speed.
#pragma once

#include "oracle/fixture.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace decant::fuzz {

/// Positions are multiples of dx/64 from the corner of the room, velocities of c0/512.
struct Point {
  std::array<int, 3> x{}, v{};
  bool operator==(const Point&) const = default;
};

/// What stands around the fluid.
enum class Room { open, tank, cup, tilting_cup };

struct Genome {
  Room room = Room::open;
  int kernel = 0;                // KernelFamily
  int support = 4;               // H = (1.6 + support/10) dx, 0 … 14
  int linear_state = 0;          // 1: exponent of the equation of state 1, else 7
  int tension = 0;               // 1: pressure may be negative
  int viscosity = 0, wall_viscosity = 0;  // hundredths of Pa·s
  int restitution = 0, friction = 0;      // tenths
  int contact = 0;                        // distance ratio (5 + contact)/20, 0 … 5
  int scale = 0;                 // dx = 2^(scale − 8) m, −2 … 4
  std::array<int, 3> offset{};   // of the whole scene, in 64 dx · 2^far
  int far = 0;                   // 0 … 4
  std::array<int, 3> size = {5, 5, 5};    // of the room, in dx, 4 … 12
  std::array<int, 3> periodic{};          // 1: the room repeats along the axis
  int layers = 2;                         // of wall particles
  int floor = 0;                          // 1: there is one, below the container or through the lowest fluid
  int belt = 0;                           // the surface runs at belt/8 m/s along x
  int turn = 0;                  // eighths of a radian that a tilting cup turns within the schedule
  int substep = 0;               // of the state, 0 … 9999
  int courant = 4;               // tenths, 1 … 4
  std::vector<Point> points;

  bool operator==(const Genome&) const = default;
};

/// A genome and its kind of state. The same seed gives the same on every machine.
Genome random_genome(std::uint64_t seed);

/// The problem; no recorded fields and no ensemble. Throws InputError where the scene is none: shrinking
/// tries such genomes.
Fixture problem_of(const Genome& genome, const std::string& name);

/// What a problem has that ports trip over, by name, in this order.
inline constexpr std::array<const char*, 15> class_names = {
    "walls",          "moving wall",   "belt",         "contact",  "periodic",
    "far away",       "isolated",      "crowded",      "coincident", "on cell faces",
    "outlier",        "negative side", "tension",      "floor",        "one or none"};
using Classes = std::array<bool, class_names.size()>;
Classes classes_of(const Fixture& fixture);

/// "12 particles, tilting cup, wendland_c2, …" for people.
std::string describe(const Genome& genome);

}  // namespace decant::fuzz
