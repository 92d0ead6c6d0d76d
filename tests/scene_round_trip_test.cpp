/// \file
/// A written scene reads back to the same bits, for scenes of every shape and option.
#include "reference/scene_file.hpp"
#include "reference/shapes.hpp"
#include "tests/generators.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace decant::test {
namespace {

/// Every real of a scene, in a fixed order, as bits, so that −0 and 0 differ.
class Bits {
 public:
  explicit Bits(const Scene& s) {
    add(s.particle_spacing, s.support_ratio, s.mass_ratio);
    add(s.fluid.rest_density, s.fluid.sound_speed, s.fluid.eos_exponent, s.fluid.viscosity, s.fluid.wall_viscosity);
    add(s.gravity), add(s.domain.min), add(s.domain.max);
    if (s.floor) add(s.floor->height);
    add(s.contact.distance_ratio, s.contact.restitution, s.contact.friction);
    for (const auto& c : s.containers) {
      add(c.origin), add(c.wall_thickness), add(c.surface_velocity);
      if (const auto* revolved = std::get_if<RevolvedShape>(&c.shape)) {
        for (const auto& p : revolved->profile) add(p[0], p[1]);
      } else {
        const auto& boxes = std::get<BoxShape>(c.shape);
        add(boxes.cavity);
        for (const auto& box : boxes.solid) add(box);
      }
      if (c.tilt) {
        add(c.tilt->pivot), add(c.tilt->axis), add(c.tilt->rate);
        for (const auto& key : c.tilt->keys) add(key.time, key.angle);
        if (const auto& o = c.tilt->oscillation) add(o->amplitude, o->frequency, o->phase);
      }
      if (c.translation) {
        add(c.translation->velocity);
        for (const auto& key : c.translation->keys) add(key.time), add(key.offset);
        if (const auto& o = c.translation->oscillation) add(o->amplitude), add(o->frequency, o->phase);
      }
    }
    for (const auto& fill : s.fills) {
      add(fill.level), add(fill.velocity);
      if (fill.box) add(*fill.box);
      for (Eigen::Index a = 0; a < 3; ++a) add(Vec3(fill.velocity_gradient.col(a)));
      add(fill.gradient_about);
      if (fill.round) {
        add(fill.round->center);
        add(fill.round->radius, fill.round->axis, fill.round->length);
      }
    }
    add(s.schedule.end, s.schedule.courant, s.schedule.max_speed.value_or(-1.0));
  }

  const std::vector<std::uint64_t>& all() const { return bits_; }

 private:
  void add(double value) { bits_.push_back(std::bit_cast<std::uint64_t>(value)); }
  void add(const Vec3& v) { add(v.x(), v.y(), v.z()); }
  void add(const SolidBox& box) { add(box.min), add(box.max); }
  template <typename... More>
  void add(double first, double second, More... more) {
    add(first);
    add(second);
    (add(more), ...);
  }

  std::vector<std::uint64_t> bits_;
};

bool same(const Scene& a, const Scene& b) {
  if (a.name != b.name || a.kernel != b.kernel || a.wall_layers != b.wall_layers ||
      a.fluid.allow_tension != b.fluid.allow_tension || a.domain.periodic != b.domain.periodic ||
      a.floor.has_value() != b.floor.has_value() || a.containers.size() != b.containers.size() ||
      a.fills.size() != b.fills.size() || a.schedule.frames != b.schedule.frames ||
      a.schedule.substeps_per_frame != b.schedule.substeps_per_frame ||
      a.schedule.substeps_derived != b.schedule.substeps_derived ||
      a.schedule.max_speed.has_value() != b.schedule.max_speed.has_value())
    return false;
  for (std::size_t i = 0; i < a.containers.size(); ++i) {
    const auto &c = a.containers[i], &d = b.containers[i];
    if (c.name != d.name || c.shape.index() != d.shape.index() || c.tilt.has_value() != d.tilt.has_value() ||
        c.translation.has_value() != d.translation.has_value())
      return false;
    if (c.tilt && c.tilt->oscillation.has_value() != d.tilt->oscillation.has_value()) return false;
    if (c.translation && c.translation->oscillation.has_value() != d.translation->oscillation.has_value()) return false;
    const auto* boxes = std::get_if<BoxShape>(&c.shape);
    if (boxes && boxes->endless != std::get<BoxShape>(d.shape).endless) return false;
  }
  for (std::size_t i = 0; i < a.fills.size(); ++i)
    if (a.fills[i].container != b.fills[i].container || a.fills[i].around != b.fills[i].around ||
        a.fills[i].box.has_value() != b.fills[i].box.has_value() ||
        a.fills[i].round.has_value() != b.fills[i].round.has_value())
      return false;
  return Bits(a).all() == Bits(b).all();
}

SolidBox box() {
  const Vec3 low = vec(-1, 1);
  return {low, low + vec(0.1, 1)};
}

Container container(int index, const Domain& domain) {
  Container c;
  c.name = "c" + std::to_string(index);
  c.origin = vec(-1, 1);
  c.wall_thickness = real(0.01, 0.1);
  switch (integer(0, 2)) {
    case 0:
      c.shape = cup_shape(real(0.1, 1), real(0.1, 1), c.wall_thickness);
      break;
    case 1: {
      // A star about (2, 0) never crosses itself and turns counter-clockwise.
      RevolvedShape star;
      const int points = integer(3, 12);
      for (int k = 0; k < points; ++k) {
        const double angle = 6.28 * k / points, radius = real(0.5, 1.5);
        star.profile.push_back({2 + radius * std::cos(angle), radius * std::sin(angle)});
      }
      c.shape = star;
      break;
    }
    default: {
      OpenFaces open{};
      for (std::size_t a = 0; a < 3; ++a)
        for (bool& face : open[a]) face = domain.periodic[a] || (a != 2 && coin());
      open[2][0] = domain.periodic[2];
      BoxShape shape = tank_shape(vec(0.1, 1), c.wall_thickness, open);
      if (shape.solid.empty()) shape.solid.push_back(box());
      shape.endless = domain.periodic;
      c.shape = shape;
    }
  }
  if (coin()) {
    Tilt tilt{vec(-1, 1), vec(0.1, 1).normalized(), {}};
    const int keys = integer(1, 4);
    for (int k = 0; k < keys; ++k) tilt.keys.push_back({k + real(0, 0.9), real(-6, 6)});
    if (coin()) tilt.rate = real(-30, 30);
    if (coin()) tilt.oscillation = {real(-1, 1), real(0.1, 9), real(-4, 4)};
    c.tilt = tilt;
  }
  if (coin()) {
    Translation& translation = c.translation.emplace();
    if (coin()) translation.keys.push_back({real(0.1, 9), vec(-1, 1)});
    if (coin()) translation.velocity = vec(-1, 1);
    if (coin()) translation.oscillation = {vec(-1, 1), real(0.1, 9), real(-4, 4)};
  }
  if (coin()) c.surface_velocity = vec(-1, 1);
  return c;
}

Scene any_scene() {
  Scene s;
  s.name = "scene-" + std::to_string(integer(0, 1000));
  s.particle_spacing = std::exp(real(std::log(1e-6), std::log(1e3)));
  s.support_ratio = real(1.5, 5);
  s.kernel = static_cast<KernelFamily>(integer(0, 2));
  s.mass_ratio = real(0.5, 2);
  s.fluid = {real(1, 2000), real(1, 100), coin() ? 7.0 : 1.0, coin(), real(0, 1), real(0, 1)};
  s.gravity = coin() ? vec(-10, 10) : Vec3(0.0, -0.0, -9.81);
  s.domain = {vec(-3, -1), vec(1, 3), {coin(), coin(), coin()}};
  if (coin()) s.floor = Floor{real(-1, 1)};
  s.contact = {real(0, 0.5), real(0, 1), real(0, 2)};
  s.wall_layers = integer(1, 8);
  const int containers = integer(0, 3);
  for (int k = 0; k < containers; ++k) s.containers.push_back(container(k, s.domain));
  const int fills = integer(1, 3);
  for (int k = 0; k < fills; ++k) {
    Fill fill;
    if (!s.containers.empty() && coin())
      fill.container = s.containers[static_cast<std::size_t>(integer(0, containers - 1))].name;
    if (!fill.container.empty() && coin()) fill.level = real(0.01, 1);
    else if (coin()) fill.box = box();
    else {
      fill.round = RoundShape{vec(-1, 1), real(0.1, 1)};
      if (coin()) {
        fill.round->axis = integer(0, 2);
        fill.round->length = real(0.1, 1);
      }
      fill.box = fill.round->bounds();
    }
    for (const auto& c : s.containers)
      if (c.name != fill.container && coin()) fill.around.push_back(c.name);
    fill.velocity = vec(-1, 1);
    if (coin()) {
      for (Eigen::Index a = 0; a < 3; ++a) fill.velocity_gradient.col(a) = vec(-9, 9);
      fill.gradient_about = vec(-1, 1);
    }
    s.fills.push_back(fill);
  }
  s.schedule.end = real(0.1, 10);
  s.schedule.frames = integer(1, 1000000);
  s.schedule.courant = real(0.01, 0.4);
  if (coin()) s.schedule.substeps_per_frame = integer(1, 1000000);
  s.schedule.substeps_derived = s.schedule.substeps_per_frame == 0 || coin();
  if (coin()) s.schedule.max_speed = real(0.1, 10);
  return s;
}

TEST(SceneRoundTrip, AnySceneReadsBackToTheSameBits) {
  EXPECT_TRUE(rc::check("parse_scene(scene_to_json(s)) == s", [] {
    const Scene scene = any_scene();
    const std::string text = scene_to_json(scene);
    const Scene back = parse_scene(text, "round-trip.json");
    RC_ASSERT(same(scene, back));
    RC_ASSERT(scene_to_json(back) == text);
  }));
}

TEST(SceneRoundTrip, ComparisonSeesOneFlippedBit) {
  Scene scene;
  Scene other = scene;
  EXPECT_TRUE(same(scene, other));
  other.gravity.x() = -0.0;
  EXPECT_FALSE(same(scene, other));
}

TEST(SceneRoundTrip, EveryShippedSceneReadsBackToTheSameBits) {
  const auto scenes = std::filesystem::path(DECANT_SOURCE_DIR) / "fixtures/scenes";
  for (const auto& entry : std::filesystem::directory_iterator(scenes)) {
    if (entry.path().filename() == "scene.schema.json") continue;
    const Scene scene = load_scene(entry.path());
    EXPECT_TRUE(same(scene, parse_scene(scene_to_json(scene), "again.json"))) << entry.path();
  }
}

}  // namespace
}  // namespace decant::test
