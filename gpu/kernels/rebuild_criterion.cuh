/// \file
/// When a neighbor list must be built anew so that it provably misses no pair. A list made at distance
/// H + s (s the skin) misses none while no two particles that were farther apart have come within H.
///
/// Nothing in that asks where the list has the particles: it is made as if they were already where their
/// velocities will have brought them halfway through its time, as far as s/2 away. They come nearer to
/// that place, pass it and go away from it, which takes twice as long as going away alone; displacements
/// below are from there.
///
/// By displacement: every |d| <= s/2, and no wall has moved further either; no pair can have closed in
/// by more than s.
/// Relative: a falling stream moves fast but together, so relative motion is bounded instead. Super-cells
/// are two cells wide, 2(H + s). Each keeps the box of its particles' displacements; for a super-cell
/// and those around it, the largest difference of displacements that the boxes allow must not exceed s.
/// Particles in super-cells that do not touch were 2(H + s) apart and need |d| <= (H + 2s)/2. Against
/// walls a particle's own way and theirs together are at most max(s, clearance − H), its distance from the
/// solids at the build.
/// Displacements are exact in fp32 (Sterbenz: both positions are nearly equal); rounding elsewhere is
/// covered by taking s smaller than the list has it.
#pragma once

#include "gpu/core/cell_table.cuh"
#include "gpu/core/stream.cuh"
#include "gpu/kernels/integrate.cuh"

#include <climits>

namespace decant::gpu {
namespace {

/// When a list is rebuilt: every so many substeps; when a particle has used up its share of the skin; when two
/// groups of cells have closed in by as much.
enum class Criterion { interval, displacement, relative };

/// Bounds of displacements by axis, floats as ordered integers.
struct DisplacementBox {
  int low[3], high[3];
};

DECANT_DEVICE float sound_skin(float skin) { return skin * (1.0f - 0x1p-10f); }

/// The skin that costs least, and how far ahead lists are made. Lists serve for k + 1 substeps where s is
/// k times the way v dt of a particle, and for no more until it is k + 1 times that; and they make the
/// kernels longer. With a build that costs b and kernels that grow by g per H of skin, b/(k + 1) + g k v dt/H
/// is least at k = √(b H/(g v dt)) − 1. Where lists have particles as they are, two ways count. Speed is
/// that of the state at hand and of nothing before, so that a resumed pour builds its lists when an
/// uninterrupted one does.
struct ChooseSkin {
  Constants c;
  const float4* velocity;
  int* fastest;  // |v|² of the fastest particle, float bits; −1 before and after
  DeviceStatus* status;
  float least, most;  // m
  bool predicts;
  float build_to_growth;  // b/g, as measured

  DECANT_DEVICE void look_at(int i) const {
    const Float3 v = xyz(velocity[i]);
    raise_to(fastest, dot(v, v));  // not negative; NaN is the largest
  }
  DECANT_DEVICE void decide() const {
    constexpr float faster = 1.12f;  // than now, soon
    const int found = atomic_load(fastest);
    *fastest = -1;
    const float per_substep = faster * radius(unordered(found > 0 ? found : 0)).r * c.dt;
    const float way = fmaxf(1e-6f * c.H, predicts ? per_substep : 2.0f * per_substep);
    const float best = rintf(radius(build_to_growth * c.H / way).r) - 1.0f, fits = floorf(most / way);
    const float s = way * (best < fits ? best : fits);
    status->skin = s < least ? least : s <= most ? s : most;
    status->prediction_time = predicts ? 0.5f * status->skin / way * c.dt : 0.0f;
  }
};

struct RebuildCriterion {
  Criterion criterion;
  int interval;          // substeps, of Criterion::interval
  const float4* origin;  // x, y, z at the build; relative: what it may move against a wall
  CellTable table;
  const int* bucket;       // at the build
  DisplacementBox* boxes;  // two sets, by the parity of the substep
  int supers;
  Branch rebuild;  // of the next substep

  DECANT_DEVICE void request_rebuild(DeviceStatus* status) const {
    if (atomic_load(&status->rebuild_needed) != 0) return;
    atomic_maximum(&status->rebuild_needed, 1);
    rebuild.request();
  }
  DECANT_DEVICE DisplacementBox* boxes_of(unsigned substep) const {
    return boxes + (substep & 1u) * static_cast<unsigned>(supers);
  }
};

/// After integration: this particle's share of the question.
template <bool periodic>
struct CheckDisplacement {
  Constants c;
  ParticleArrays a;
  RebuildCriterion w;

  struct Prefetched {
    float4 origin;
    float skin, wall_displacement;
  };
  DECANT_DEVICE Prefetched prefetch(int i) const {
    // What rounding may add to a displacement is taken off beforehand.
    return {w.origin[i], sound_skin(a.status->skin), a.status->wall_displacement};
  }
  DECANT_DEVICE void operator()(int i, Float3 x, const Prefetched& at_build) const {
    if (w.criterion == Criterion::interval) {
      if (i == 0 && a.status->substeps_begun % static_cast<unsigned>(w.interval) == 0) request_rebuild();
      return;
    }
    const Float3 d = nearest_image<periodic>(c, x - xyz(at_build.origin));
    const float skin = at_build.skin, wall_displacement = at_build.wall_displacement;
    if (w.criterion == Criterion::displacement) {
      const float most = 0.5f * skin;
      if (!(dot(d, d) <= most * most && wall_displacement + rounding_of(x) <= most)) request_rebuild();
      return;
    }
    const float farthest = 0.5f * c.H + skin, of_walls = at_build.origin.w - wall_displacement - rounding_of(x);
    if (!(dot(d, d) <= farthest * farthest && of_walls > 0.0f && dot(d, d) <= of_walls * of_walls)) request_rebuild();
    enter(i, d);
  }

 private:
  DECANT_DEVICE void request_rebuild() const { w.request_rebuild(a.status); }
  DECANT_DEVICE void enter(int i, Float3 d) const {
    DisplacementBox& box = w.boxes_of(a.status->substeps_begun)[w.table.super_of(w.bucket[i])];
    const int at[3] = {ordered(d.x), ordered(d.y), ordered(d.z)};
    for (int k = 0; k < 3; ++k) {
      // Most do not widen the box; looking first saves their atomics.
      if (at[k] < atomic_load(&box.low[k])) atomic_minimum(&box.low[k], at[k]);
      if (at[k] > atomic_load(&box.high[k])) atomic_maximum(&box.high[k], at[k]);
    }
  }
};

struct ClearDisplacementBoxes {
  DisplacementBox* boxes;
  DECANT_DEVICE void operator()(int k) const { boxes[k] = {{INT_MAX, INT_MAX, INT_MAX}, {INT_MIN, INT_MIN, INT_MIN}}; }
};
DECANT_KERNEL(256) clear_displacement_boxes_kernel(int boxes, ClearDisplacementBoxes clear) {
  for_each_thread(boxes, clear);
}

/// Compares every super-cell's box with those around it, and clears the other set for the next substep.
struct CompareDisplacementBoxes {
  RebuildCriterion w;
  DeviceStatus* status;

  DECANT_DEVICE void operator()(int super) const {
    ClearDisplacementBoxes{w.boxes_of(status->substeps_begun + 1)}(super);
    const DisplacementBox* boxes = w.boxes_of(status->substeps_begun);
    const DisplacementBox own = boxes[super];
    if (own.low[0] > own.high[0]) return;
    DisplacementBox all = own;
    w.table.supers_around(super, [&](int other) {
      const DisplacementBox& box = boxes[other];
      for (int k = 0; k < 3; ++k) {
        all.low[k] = box.low[k] < all.low[k] ? box.low[k] : all.low[k];
        all.high[k] = box.high[k] > all.high[k] ? box.high[k] : all.high[k];
      }
    });
    float most = 0.0f;
    for (int k = 0; k < 3; ++k) {
      const float up = unordered(all.high[k]) - unordered(own.low[k]);
      const float down = unordered(own.high[k]) - unordered(all.low[k]);
      const float widest = up > down ? up : down;
      most += widest * widest;
    }
    const float skin = sound_skin(status->skin);
    if (!(most <= skin * skin)) w.request_rebuild(status);
  }
};
DECANT_KERNEL(256) compare_displacement_boxes_kernel(int supers, CompareDisplacementBoxes compare) {
  for_each_thread(supers, compare);
}

}  // namespace
}  // namespace decant::gpu
