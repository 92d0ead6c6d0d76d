/// \file
/// When a neighbor list must be built anew so that it provably misses no pair. A list made at distance
/// H + s (s the skin) misses none while no two particles that were farther apart have come within H.
///
/// Walls, both triggers: a wall particle never moves in its frame, so particle i is safe while its own
/// way in that frame is at most max(s, clearance − H), its distance from the solid at the build.
/// Global: every displacement |d| <= s/2; no pair can have closed in by more than s.
/// Local: a falling stream moves fast but together, so relative motion is bounded instead. Super-cells
/// are two cells wide, 2(H + s). Each keeps the box of its particles' displacements; for a super-cell
/// and those around it, the largest difference of displacements that the boxes allow must not exceed s.
/// Particles in super-cells that do not touch were 2(H + s) apart and need |d| <= (H + 2s)/2.
/// Displacements are exact in fp32 (Sterbenz: both positions are nearly equal); rounding elsewhere is
/// covered by taking s smaller than the list has it.
#pragma once

#include "gpu/passes.cuh"
#include "gpu/queue.cuh"

#include <climits>

namespace decant::gpu::DECANT_EXECUTOR {

enum class Trigger { never, every, global, local };

/// Bounds of displacements by axis, floats as ordered integers.
struct DisplacementBox {
  int low[3], high[3];
};

DECANT_DEVICE int ordered(float f) {
  int bits;
  memcpy(&bits, &f, sizeof bits);
  return bits >= 0 ? bits : bits ^ 0x7FFFFFFF;
}
DECANT_DEVICE float unordered(int i) {
  const int bits = i >= 0 ? i : i ^ 0x7FFFFFFF;
  float f;
  memcpy(&f, &bits, sizeof f);
  return f;
}

DECANT_DEVICE float sound_skin(float skin) { return skin * (1.0f - 0x1p-10f); }

/// The fastest particle's speed, for SkinPass.
struct FastestPass {
  Arrays a;
  const float4* velocity;

  DECANT_DEVICE void operator()(int i) const {
    const Float3 v = xyz(velocity[i]);
    const int bits = ordered(dot(v, v));  // not negative; NaN is the largest
    if (bits > atomic_load(&a.mailbox->fastest)) atomic_maximum(&a.mailbox->fastest, bits);
  }
};

/// The skin that costs least. Lists serve for k + 1 substeps where s is k times the way 2 v dt of two
/// particles, and for no more until it is k + 1 times that; and they make the passes longer. With a build
/// that costs b and passes that grow by g an H of skin, b/(k + 1) + g k 2 v dt/H is least at
/// k = √(b H/(g 2 v dt)) − 1. Speed is that of the state at hand and of nothing before, so that a resumed
/// pour builds its lists when an uninterrupted one does.
struct SkinPass {
  Constants c;
  Mailbox* mailbox;
  float least, most;  // m

  DECANT_DEVICE void operator()(int) const {
    constexpr float build_to_growth = 0.7f;  // b/g as measured
    constexpr float faster = 1.12f;          // than now, soon
    const float way =
        fmaxf(1e-6f * c.H, 2.0f * faster * radius(unordered(mailbox->fastest)).r * c.dt);
    const float best = rintf(radius(build_to_growth * c.H / way).r) - 1.0f, fits = floorf(most / way);
    const float s = way * (best < fits ? best : fits);
    mailbox->skin = s < least ? least : s <= most ? s : most;
  }
};

struct Watch {
  Trigger trigger;
  int interval;              // substeps, of Trigger::every
  unsigned moving;           // bit k: container k moves; those from 32 on are taken to
  const float4* origin;      // x, y, z at the build; what it may move against a wall
  const DevicePose* built;   // poses at the build
  CellTable table;
  const int* bucket;         // at the build
  DisplacementBox* boxes;    // two sets, by the parity of the substep
  int supers;
  Wake wake;                 // the next substep's build

  /// For the lists to be built anew.
  DECANT_DEVICE void call(Mailbox* mailbox) const {
    if (atomic_load(&mailbox->stale) != 0) return;
    atomic_maximum(&mailbox->stale, 1);
    wake();
  }
  DECANT_DEVICE DisplacementBox* boxes_of(unsigned substep) const {
    return boxes + (substep & 1u) * static_cast<unsigned>(supers);
  }
};

/// After integration: this particle's share of the question.
template <bool periodic>
struct WatchParticle {
  Constants c;
  Arrays a;
  Watch w;

  DECANT_DEVICE void operator()(int i, Float3 x, const DevicePose* poses) const {
    if (w.trigger == Trigger::every) {
      if (i == 0 && a.mailbox->begun % static_cast<unsigned>(w.interval) == 0) call();
      return;
    }
    const float4 origin = read_only(w.origin + i);
    const Float3 from = xyz(origin);
    const Float3 d = nearest_image<periodic>(c, x - from);
    // What rounding may add to a way is taken off beforehand.
    const float skin = sound_skin(read_only(&a.mailbox->skin));
    const float farthest = w.trigger == Trigger::local ? 0.5f * c.H + skin : 0.5f * skin;
    bool stale = !(dot(d, d) <= farthest * farthest);
    const float slack = origin.w;
    for (int k = 0; k < a.containers; ++k) {
      if (k < 32 && !(w.moving >> k & 1u)) {
        const float limit = slack - 0x1p-19f * (fabsf(x.x) + fabsf(x.y) + fabsf(x.z));
        stale = stale || !(limit > 0.0f && dot(d, d) <= limit * limit);
        continue;
      }
      const Float3 now = rotate_back(poses[k], x - poses[k].translation);
      const Float3 then = rotate_back(w.built[k], from - w.built[k].translation);
      const Float3 way = nearest_image<periodic>(c, now - then);
      const float rounding = 0x1p-19f * (fabsf(x.x) + fabsf(x.y) + fabsf(x.z) + fabsf(now.x) +
                                         fabsf(now.y) + fabsf(now.z));
      const float limit = slack - rounding;
      stale = stale || !(limit > 0.0f && dot(way, way) <= limit * limit);
    }
    if (stale) call();
    if (w.trigger == Trigger::local) enter(i, d);
  }

 private:
  DECANT_DEVICE void call() const { w.call(a.mailbox); }
  DECANT_DEVICE void enter(int i, Float3 d) const {
    DisplacementBox& box = w.boxes_of(a.mailbox->begun)[w.table.super_of(w.bucket[i])];
    const int at[3] = {ordered(d.x), ordered(d.y), ordered(d.z)};
    for (int k = 0; k < 3; ++k) {
      // Most do not widen the box; looking first saves their atomics.
      if (at[k] < atomic_load(&box.low[k])) atomic_minimum(&box.low[k], at[k]);
      if (at[k] > atomic_load(&box.high[k])) atomic_maximum(&box.high[k], at[k]);
    }
  }
};

struct ClearBoxes {
  DisplacementBox* boxes;
  DECANT_DEVICE void operator()(int k) const {
    boxes[k] = {{INT_MAX, INT_MAX, INT_MAX}, {INT_MIN, INT_MIN, INT_MIN}};
  }
};

/// Compares every super-cell's box with those around it, and clears the other set for the next substep.
struct ComparePass {
  Watch w;
  Mailbox* mailbox;

  DECANT_DEVICE void operator()(int super) const {
    ClearBoxes{w.boxes_of(mailbox->begun + 1)}(super);
    const DisplacementBox* boxes = w.boxes_of(mailbox->begun);
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
    const float skin = sound_skin(mailbox->skin);
    if (!(most <= skin * skin)) w.call(mailbox);
  }
};

}  // namespace decant::gpu::DECANT_EXECUTOR
