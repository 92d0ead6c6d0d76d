/// \file
/// Scenes and states under the transformations. Fills and schedules stay: they do not touch a state
/// that is given.
#include "oracle/checks/transformed.hpp"

#include <algorithm>
#include <numeric>
#include <random>

namespace decant {
namespace {

std::vector<Eigen::Index> ids_of(const ParticleState& state) {
  std::vector<Eigen::Index> ids(static_cast<std::size_t>(state.size()));
  std::iota(ids.begin(), ids.end(), Eigen::Index{0});
  return ids;
}

TransformedProblem permuted(const Scene& scene, const ParticleState& state, unsigned seed) {
  std::vector<Eigen::Index> order = ids_of(state);
  std::mt19937 random(seed);
  std::shuffle(order.begin(), order.end(), random);
  TransformedProblem p{"permuted", scene, state, order};
  p.state.position = state.position(Eigen::all, order);
  p.state.velocity = state.velocity(Eigen::all, order);
  return p;
}

TransformedProblem moved(const Scene& scene, const ParticleState& state, const Vec3& by) {
  TransformedProblem p{"translated", scene, state, ids_of(state)};
  p.scene.domain.min += by;
  p.scene.domain.max += by;
  if (p.scene.floor) p.scene.floor->height += by.z();
  for (Container& c : p.scene.containers) {
    c.origin += by;
    if (c.tilt) c.tilt->pivot += by;
  }
  p.state.position.colwise() += by;
  p.state.quantise();
  return p;
}

Vec3 turned(const Vec3& x) { return {-x.y(), x.x(), x.z()}; }

SolidBox turned(const SolidBox& box) {
  const Vec3 a = turned(box.min), b = turned(box.max);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

TransformedProblem turned(const Scene& scene, const ParticleState& state) {
  TransformedProblem p{"rotated", scene, state, ids_of(state)};
  const SolidBox domain = turned(SolidBox{scene.domain.min, scene.domain.max});
  p.scene.domain.min = domain.min;
  p.scene.domain.max = domain.max;
  std::swap(p.scene.domain.periodic[0], p.scene.domain.periodic[1]);
  p.scene.gravity = turned(scene.gravity);
  for (Container& c : p.scene.containers) {
    c.origin = turned(c.origin);
    c.surface_velocity = turned(c.surface_velocity);
    if (c.tilt) {
      c.tilt->pivot = turned(c.tilt->pivot);
      c.tilt->axis = turned(c.tilt->axis);
    }
    if (c.translation) {
      for (TranslationKey& key : c.translation->keys) key.offset = turned(key.offset);
      c.translation->velocity = turned(c.translation->velocity);
      if (auto& o = c.translation->oscillation) o->amplitude = turned(o->amplitude);
    }
    auto* boxes = std::get_if<BoxShape>(&c.shape);
    if (!boxes) continue;
    boxes->cavity = turned(boxes->cavity);
    for (SolidBox& box : boxes->solid) box = turned(box);
    std::swap(boxes->endless[0], boxes->endless[1]);
  }
  for (auto* m : {&p.state.position, &p.state.velocity})
    for (Eigen::Index i = 0; i < m->cols(); ++i) m->col(i) = turned(Vec3(m->col(i)));
  return p;
}

}  // namespace

std::vector<TransformedProblem> transformed_problems(const Scene& scene, const ParticleState& state, unsigned seed) {
  return {permuted(scene, state, seed), moved(scene, state, Vec3::Constant(0.5)), turned(scene, state)};
}

}  // namespace decant
