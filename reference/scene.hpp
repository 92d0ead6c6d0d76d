/// \file
/// What a scene is: everything that changes the answer, and nothing else. Plain data, SI units.
/// A backend's own options (skin, rebuild interval, lanes, capacities) are not scene.
///
/// Legend used throughout the project: dx particle spacing, H support radius, h = H/2 smoothing
/// length, m particle mass, rho0 rest density, c0 sound speed, gamma exponent of the equation of
/// state, B its stiffness, mu dynamic viscosity, mu_w that of the wall terms, dt substep, t time.
#pragma once

#include <Eigen/Dense>

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace decant {

using Vec3 = Eigen::Vector3d;
inline constexpr double infinity = std::numeric_limits<double>::infinity();

enum class KernelFamily { cubic_spline, wendland_c2, mueller2003 };
/// As scenes and files name them.
inline constexpr std::array<const char*, 3> kernel_names = {"cubic_spline", "wendland_c2", "mueller2003"};
inline const char* to_string(KernelFamily family) { return kernel_names.at(static_cast<std::size_t>(family)); }

/// Material of the fluid, and the walls' share of its viscosity.
struct FluidProperties {
  double rest_density = 1000.0;  // kg/m³
  double sound_speed = 10.0;     // m/s
  double eos_exponent = 7.0;     // 7 or 1
  bool allow_tension = false;    // false: p = max(p, 0)
  double viscosity = 0.05;       // Pa·s
  double wall_viscosity = 0.1;   // Pa·s; twice the viscosity unless the scene says otherwise
};

/// amplitude · sin(2π frequency t + phase), added to what the keys of a schedule say.
template <class Value>
struct Oscillation {
  Value amplitude;
  double frequency;  // Hz, > 0
  double phase = 0;  // rad
};

/// One point of a tilt schedule. Between two keys the angle follows the smoothstep 3s² − 2s³;
/// before the first it rests, after the last it goes on at the tilt's rate.
struct TiltKey {
  double time;   // s
  double angle;  // rad, right-handed about the axis; any number of turns
};

/// Rigid rotation of a container about a line, which goes along with the container's translation.
struct Tilt {
  Vec3 pivot;                 // m, a point of the line, world before any translation
  Vec3 axis;                  // unit vector
  std::vector<TiltKey> keys;  // at least one; times strictly increasing
  /// rad/s after the last key. Where it is not 0 and there are two keys or more, the last smoothstep
  /// ends with this slope: rate · T (s³ − s²) is added to it, T being the time between the keys.
  double rate = 0;
  std::optional<Oscillation<double>> oscillation = std::nullopt;  // rad
};

/// One point of a translation schedule, between keys as in a tilt.
struct TranslationKey {
  double time;  // s
  Vec3 offset;  // m, world, from where the container's origin and tilt have it
};

/// Rigid translation of a container, of its tilt's line too.
struct Translation {
  std::vector<TranslationKey> keys = {{0.0, Vec3::Zero()}};  // at least one; times strictly increasing
  Vec3 velocity = Vec3::Zero();  // m/s after the last key, which it is reached at as a tilt's rate is
  std::optional<Oscillation<Vec3>> oscillation = std::nullopt;  // m
};

/// Solid of revolution about the frame's z axis. `profile` is the closed outline of the solid's
/// cross-section in (r, z), m, r >= 0, listed so that the solid lies to the left. Edges on the
/// axis are not surface.
struct RevolvedShape {
  std::vector<std::array<double, 2>> profile;
};

struct SolidBox {
  Vec3 min, max;  // m, container frame
};

/// Union of axis-aligned boxes around a cavity (a tank, a channel). Where a periodic axis cuts the
/// solid, the cut is not surface.
struct BoxShape {
  SolidBox cavity;                                      // the room for fluid; decides "in which container"
  std::vector<SolidBox> solid;                          // may touch and overlap
  std::array<bool, 3> endless = {false, false, false};  // the domain's periodic axes
};

struct Container {
  std::string name;
  std::variant<RevolvedShape, BoxShape> shape;
  Vec3 origin = Vec3::Zero();  // m, world position of the container's frame while it is not moved
  double wall_thickness = 0;   // m, the thinnest wall of the solid
  std::optional<Tilt> tilt;
  /// m/s, container frame: the surface runs like a belt while the container stays in its place.
  Vec3 surface_velocity = Vec3::Zero();
  std::optional<Translation> translation = std::nullopt;
};

/// A ball, or a rod along one axis.
struct RoundShape {
  Vec3 center;        // m
  double radius;      // m
  int axis = -1;      // 0 … 2: of a rod; −1: a ball
  double length = 0;  // m, of a rod, half of it on either side of the center

  SolidBox bounds() const {
    Vec3 half = Vec3::Constant(radius);
    if (axis >= 0) half[axis] = 0.5 * length;
    return {center - half, center + half};
  }
};

/// Fluid at the start: a lattice of spacing dx that begins dx/2 from the surfaces, in a container up to
/// a level, in a box, or in a ball or rod, whose lattice lies evenly about its center.
struct Fill {
  std::string container;        // empty: the shape is in the world and stands alone
  double level = 0;             // m above the cavity's bottom (container) — unused for a shape
  std::optional<SolidBox> box;  // m, world, or container frame where a container is named
  // v(x) = velocity + velocity_gradient (x − gradient_about), world
  Vec3 velocity = Vec3::Zero();                                 // m/s
  Eigen::Matrix3d velocity_gradient = Eigen::Matrix3d::Zero();  // 1/s
  Vec3 gradient_about = Vec3::Zero();                           // m
  std::optional<RoundShape> round = std::nullopt;               // what there is of `box`, its bounds
  /// Names of containers within the fluid: no particle starts within dx/2 of their solids.
  std::vector<std::string> around = {};

  Vec3 velocity_at(const Vec3& x) const { return velocity + velocity_gradient * (x - gradient_about); }
};

/// Analytic plane z = height without wall particles.
struct Floor {
  double height;  // m
};

/// Where particles may be. Leaving it is an error on a free axis and a wrap on a periodic one.
struct Domain {
  Vec3 min = Vec3::Zero(), max = Vec3::Zero();  // m
  std::array<bool, 3> periodic = {false, false, false};
};

struct Contact {
  double distance_ratio = 0.25;  // contact distance / dx
  double restitution = 0.0;      // 0 … 1
  double friction = 0.0;         // >= 0
};

struct Schedule {
  double end = 0;                   // s
  int frames = 1;                   // written after the initial one
  int substeps_per_frame = 0;       // 0: not derived yet
  bool substeps_derived = true;     // false: the scene sets them, and no rule changes them
  double courant = 0.4;             // dt <= courant · h / (c0 + v_max)
  std::optional<double> max_speed;  // m/s; replaces the estimate from the fall height
};

struct Scene {
  std::string name;
  double particle_spacing = 0;  // dx, m
  double support_ratio = 2.0;   // H / dx
  KernelFamily kernel = KernelFamily::cubic_spline;
  double mass_ratio = 1.0;  // m / (rho0 dx³); a family that starts compressed is calibrated here
  FluidProperties fluid;
  Vec3 gravity = Vec3(0, 0, -9.81);  // m/s², or any constant body force
  Domain domain;
  std::optional<Floor> floor;
  Contact contact;
  int wall_layers = 2;
  std::vector<Container> containers;
  std::vector<Fill> fills;
  Schedule schedule;

  double support_radius() const { return support_ratio * particle_spacing; }
  double smoothing_length() const { return 0.5 * support_radius(); }
  double particle_mass() const {
    return mass_ratio * fluid.rest_density * particle_spacing * particle_spacing * particle_spacing;
  }
  /// B = rho0 c0² / gamma, Pa.
  double eos_stiffness() const {
    return fluid.rest_density * fluid.sound_speed * fluid.sound_speed / fluid.eos_exponent;
  }
  double time_step() const {
    return schedule.end / (static_cast<double>(schedule.frames) * schedule.substeps_per_frame);
  }
  /// t = n·dt, never accumulated.
  double time_at(std::int64_t substep) const { return static_cast<double>(substep) * time_step(); }
  double contact_distance() const { return contact.distance_ratio * particle_spacing; }
};

}  // namespace decant
