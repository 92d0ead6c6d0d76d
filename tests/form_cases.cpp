/// \file
/// Random choices of forms, and the states that they are tried on.
#include "reference/pose.hpp"
#include "reference/sampling.hpp"
#include "reference/shapes.hpp"
#include "reference/solver.hpp"
#include "tests/forms.hpp"

#include <algorithm>
#include <cmath>

namespace decant::test {
namespace {

/// Names of a choice, in the order of its enumerators.
struct Choice {
  const char* name;
  std::vector<const char*> values;
  std::size_t chosen;
};

template <class Enum>
std::size_t at(Enum value) {
  return static_cast<std::size_t>(value);
}

}  // namespace

std::map<std::string, std::string> choices(const Forms& f) {
  const Choice all[] = {{"register", {"parts", "gravity first", "gravity last"}, at(f.accumulate)},
                        {"order", {"by id", "smallest first", "largest first", "random", "pairwise"}, at(f.order)},
                        {"root", {"root", "r2 * (1/root)"}, at(f.root)},
                        {"power", {"products", "pow"}, at(f.power)},
                        {"polynomial", {"horner", "monomials", "factored"}, at(f.polynomial)},
                        {"frame", {"world", "cell"}, at(f.frame)},
                        {"placing", {"R l + t", "p + R (l + o - P)", "quaternion"}, at(f.placing)},
                        {"velocity", {"omega x (x - p)", "omega x R (l + o - P)"}, at(f.velocity)},
                        {"constants", {"rounded", "formed in fp32"}, at(f.constants)},
                        {"image", {"of difference", "ghost"}, at(f.image)},
                        {"quotient", {"divided", "by inverse"}, at(f.quotient)},
                        {"factor", {"in terms", "after sum"}, at(f.factor)},
                        {"fused", {"no", "yes"}, f.fused},
                        {"underflow", {"gradual", "to zero"}, f.flushed}};
  std::map<std::string, std::string> names;
  for (const Choice& c : all) names[c.name] = c.values[c.chosen];
  return names;
}

Forms random_forms(std::mt19937& random) {
  const auto pick = [&]<class Enum>(Enum& to, int n) {
    to = static_cast<Enum>(std::uniform_int_distribution<int>(0, n - 1)(random));
  };
  Forms f;
  pick(f.accumulate, 3);
  pick(f.order, 5);
  pick(f.root, 2);
  pick(f.power, 2);
  pick(f.polynomial, 3);
  pick(f.frame, 2);
  pick(f.placing, 3);
  pick(f.velocity, 2);
  pick(f.constants, 2);
  pick(f.image, 2);
  pick(f.quotient, 2);
  pick(f.factor, 2);
  const auto yes = [&] { return std::uniform_int_distribution<int>(0, 1)(random) == 1; };
  f.fused = yes();
  f.flushed = yes();
  return f;
}

Fixture random_form_case(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto real = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto chance = [&](double p) { return real(0, 1) < p; };
  const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  const auto vector = [&](double most) { return Vec3(real(-most, most), real(-most, most), real(-most, most)); };
  Fixture f;
  f.name = f.phase = "forms-" + std::to_string(seed);
  Scene& scene = f.scene;
  scene.name = f.name;
  const double dx = scene.particle_spacing = chance(0.2) ? 0x1p-7 : real(0.002, 0.02);
  scene.kernel = static_cast<KernelFamily>(pick(3));
  scene.support_ratio = chance(0.3) ? 2 + pick(3) : real(2, 4);
  scene.mass_ratio = chance(0.7) ? 1 : real(0.9, 1.1);
  scene.fluid.rest_density = chance(0.5) ? 1000 : real(700, 1300);
  scene.fluid.sound_speed = real(2, 30);
  scene.fluid.allow_tension = chance(0.5);
  scene.fluid.eos_exponent = chance(0.7) ? 7 : 1;
  scene.fluid.viscosity = chance(0.2) ? 0 : std::exp2(real(-12, 0));
  scene.fluid.wall_viscosity = scene.fluid.viscosity * real(0.5, 4);
  if (chance(0.2)) scene.gravity = vector(20);
  scene.schedule = {1, 10, 1000, true, 0.4, {}};

  const int cells[3] = {3 + pick(4), 3 + pick(4), 3 + pick(4)};
  Vec3 size = dx * Vec3(cells[0], cells[1], cells[2]);
  const Vec3 corner = chance(0.5) ? vector(std::exp2(real(-6, 2))) : Vec3::Zero();
  const bool tank = chance(0.6), tilts = tank && chance(0.6);
  const int periodic = !tank && chance(0.4) ? pick(3) : -1;
  Pose pose;
  if (tank) {
    Container container{"tank", tank_shape(size, 3 * dx, {}), corner, 3 * dx, {}};
    if (tilts) {
      const Vec3 pivot = corner + vector(std::exp2(real(-5, 4.3)));
      container.tilt = Tilt{pivot, vector(1).normalized(), {{0, 0}, {1, real(-3, 3)}}};
      f.state.substep = pick(10000);
    }
    if (chance(0.3)) {
      container.translation = Translation{{{0, Vec3::Zero()}, {1, vector(2)}}};
      f.state.substep = pick(10000);
    }
    if (chance(0.2)) container.surface_velocity = vector(1);
    scene.containers.push_back(container);
    pose = pose_at(scene.containers[0], scene.time_at(f.state.substep));
  }

  // From an exact lattice over one that differs in its last places to a cloud.
  const double jitter = chance(0.4) ? 0 : std::exp2(real(-24, -1.5));
  const double spacing = dx * (chance(0.5) ? 1 : real(0.8, 1.2)), filled = chance(0.5) ? 1 : real(0.1, 1);
  if (periodic >= 0)  // a pair must not be met twice
    size[periodic] = std::max(size[periodic], (2 * scene.support_ratio + 1) * dx);
  std::vector<Vec3> x;
  Vec3 count = (size / spacing).array().floor();
  if (periodic >= 0) count[periodic] = std::ceil(size[periodic] / dx - 0.5);
  for (int k = 0; k < count.z(); ++k)
    for (int j = 0; j < count.y(); ++j)
      for (int i = 0; i < count.x(); ++i)
        if (chance(filled)) {
          Vec3 at = spacing * (Vec3(i, j, k) + Vec3::Constant(0.5)) + jitter * spacing * vector(1);
          if (periodic >= 0) at[periodic] -= size[periodic] * std::floor(at[periodic] / size[periodic]);
          x.push_back(tank ? pose.to_world(at) : corner + at);
        }
  const auto n = static_cast<Eigen::Index>(x.size());
  f.state.position.resize(3, n);
  f.state.velocity.resize(3, n);
  const Vec3 drift = chance(0.5) ? vector(2) : Vec3::Zero();
  const double spread = chance(0.5) ? std::exp2(real(-20, 1)) : 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    f.state.position.col(i) = x[static_cast<std::size_t>(i)];
    f.state.velocity.col(i) = drift + spread * vector(1);
  }
  if (chance(0.15))  // as what is left of one by a wall's rotated normal
    for (Eigen::Index c = 0; c < 3; ++c) f.state.velocity.row(c) *= std::exp2(real(-149, -60));
  f.state.quantise();
  scene.domain = {corner - Vec3::Constant(50), corner + Vec3::Constant(50), {}};
  if (periodic >= 0) {
    scene.domain.periodic[static_cast<std::size_t>(periodic)] = true;
    scene.domain.min[periodic] = corner[periodic];
    scene.domain.max[periodic] = corner[periodic] + size[periodic];
  }
  return f;
}

}  // namespace decant::test
