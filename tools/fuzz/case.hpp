/// \file
/// A fuzzed case as whole numbers: a small scene and a state in it, positions and velocities on
/// lattices, so that faces of cells, coincidences and exact distances come up, and so that minimising
/// has somewhere to go: every number may come nearer to 0, every particle and container may leave.
///
/// Legend: dx particle spacing, H support radius, c0 sound speed.
#pragma once

#include "oracle/solution/fixture.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace decant::fuzz {

/// Positions are multiples of dx/64 from the corner of a room, velocities of c0/512.
struct Point {
  std::array<int, 3> x{}, v{};
  int room = 0;  // whose: of the container of that number; 0 without any: the scene's
  bool operator==(const Point&) const = default;
};

/// What a container is made of: boxes, then solids of revolution.
enum class Form { tank, open_tank, steps, cup, bowl, hourglass, plug };
inline constexpr std::array<const char*, 7> form_names = {"tank", "open tank", "steps", "cup",
                                                          "bowl", "hourglass", "plug"};
constexpr bool is_revolved(Form form) { return form >= Form::cup; }

/// A key of a tilt schedule after the first.
struct TiltStep {
  int substeps = 1;  // after the key before it, 1 …
  int speed = 0;     // of the container's farthest point, at its fastest, in c0/256, −48 … 48
  bool operator==(const TiltStep&) const = default;
};

/// A key of a translation schedule after the first.
struct TranslationStep {
  int substeps = 1;            // after the key before it, 1 …
  std::array<int, 3> speed{};  // at its fastest, c0/256, −24 … 24
  bool operator==(const TranslationStep&) const = default;
};

/// An oscillation.
struct Oscillating {
  std::array<int, 3> speed{};  // at its fastest, c0/256; of a tilt the first alone, of the farthest point
  int period = 40, phase = 0;  // substeps, eighths of a radian
  bool operator==(const Oscillating&) const = default;
  bool any() const { return speed != std::array<int, 3>{}; }
};

struct Vessel {
  Form form = Form::tank;
  std::array<int, 3> size = {5, 5, 5};  // of its room, in dx
  std::array<int, 3> belt{};            // surface velocity, c0/64, container frame
  // Of all but the first: which side of those before it (−x, +x, −y, …), how far beyond H, in dx/16, and
  // how far it is shifted across, in dx.
  int side = 0, gap = 0;
  std::array<int, 2> shift{};
  int tilts = 0;  // 1: it has a tilt schedule
  std::array<int, 3> axis = {0, 1, 0};
  std::array<int, 3> pivot{};   // from the middle of its room, in dx
  int angle = 0;                // of the first key, eighths of a radian, −16 … 16
  int start = 0;                // of the first key, substeps from the state's
  std::vector<TiltStep> steps;  // the keys after it
  int rate = 0;                 // after the last, as a step's speed
  Oscillating tilt_oscillation;
  int translates = 0;         // 1: it has a translation schedule
  int translation_start = 0;  // of the first key, substeps from the state's
  std::vector<TranslationStep> translation_steps;
  std::array<int, 3> velocity{};  // after the last key, c0/256
  Oscillating translation_oscillation;
  bool operator==(const Vessel&) const = default;
};

struct Case {
  int kernel = 0;                             // KernelFamily
  int support = 4;                            // H = (1.6 + support/10) dx, 0 … 14
  int mass = 0;                               // m = (1 + mass/100) rho0 dx³
  int rest_density = 0;                       // 1000 + 100 · rest_density kg/m³, −9 …
  int sound_speed = 0;                        // 10 + sound_speed m/s, −8 …
  int linear_state = 0;                       // 1: exponent of the equation of state 1, else 7
  int tension = 0;                            // 1: pressure may be negative
  int viscosity = 0, wall_viscosity = 0;      // hundredths of Pa·s
  std::array<int, 3> gravity = {0, 0, -981};  // cm/s²
  int restitution = 0, friction = 0;          // tenths
  int contact = 0;                            // distance ratio (5 + contact)/20, −5 … 5
  int scale = 0;                              // dx = 2^(scale − 8) m, −2 … 4
  std::array<int, 3> offset{};                // of the whole scene, in 64 dx · 2^far
  int far = 0;                                // 0 … 4
  std::array<int, 3> size = {5, 5, 5};        // of the room where no container is, in dx, 4 … 12
  std::array<int, 3> periodic{};              // 1: the domain repeats along the axis
  int layers = 2;                             // of wall particles
  int floor = 0;                              // 1: there is one, below the containers or through the lowest fluid
  int floor_gap = 0;                          // below the containers, dx/16
  std::vector<Vessel> vessels;
  int reversed = 0;  // 1: the scene lists its containers from the last on
  int substep = 0;   // of the state, 0 … 999
  int courant = 4;   // tenths, 1 … 4
  int frames = 1;
  std::vector<Point> points;

  bool operator==(const Case&) const = default;
  /// The room that the first container has, or the scene without one.
  const std::array<int, 3>& room() const { return vessels.empty() ? size : vessels[0].size; }
};

/// Points of a room's lattice in a particle spacing.
inline constexpr int fine = 64;

/// A case and its kind of state. The same seed gives the same on every machine.
Case random_case(std::uint64_t seed);

/// The case; no recorded fields and no ensemble. Throws InputError where the scene is none: minimising
/// tries such cases.
Fixture fixture_of(const Case& fuzz_case, const std::string& name);

/// What a case has that ports trip over, by name, in this order.
inline constexpr std::array<const char*, 24> tag_names = {"walls",
                                                          "moving wall",
                                                          "belt",
                                                          "contact",
                                                          "periodic",
                                                          "far away",
                                                          "isolated",
                                                          "crowded",
                                                          "coincident",
                                                          "on cell faces",
                                                          "outlier",
                                                          "negative side",
                                                          "tension",
                                                          "floor",
                                                          "one or none",
                                                          "tilted box",
                                                          "translating wall",
                                                          "tilt of three keys",
                                                          "slanted outline",
                                                          "several containers",
                                                          "at wall and floor",
                                                          "periods that differ",
                                                          "calibrated mass",
                                                          "gravity not down"};
using Tags = std::array<bool, tag_names.size()>;
Tags tags_of(const Fixture& fixture);

/// "12 particles, tilting cup, wendland_c2, …" for people.
std::string describe(const Case& fuzz_case);

}  // namespace decant::fuzz
