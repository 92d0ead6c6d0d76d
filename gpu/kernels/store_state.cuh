/// \file
/// The state on its way to the host, in the order of the ids, and to where it is kept.
#pragma once

#include "gpu/core/teams.cuh"

namespace decant::gpu {
namespace {

struct StoreState {
  int n;
  Particles state;
  const int* id;
  float *position, *velocity;  // [n,3] by id

  DECANT_DEVICE void operator()(int i) const {
    const int to = id[i];
    if (to < 0 || to >= n) return;  // somebody's row stays unwritten, which shows
    const float4 x = state.position[i], v = state.velocity[i];
    store(position, to, {x.x, x.y, x.z});
    store(velocity, to, {v.x, v.y, v.z});
  }
};
DECANT_KERNEL(256) store_state_kernel(int n, StoreState store) { for_each_thread(n, store); }

struct CopyState {
  Particles from;
  const int* from_id;
  Particles to;
  int* to_id;

  DECANT_DEVICE void operator()(int i) const {
    to.position[i] = from.position[i];
    to.velocity[i] = from.velocity[i];
    to_id[i] = from_id[i];
  }
};
DECANT_KERNEL(256) copy_state_kernel(int n, CopyState copy) { for_each_thread(n, copy); }

}  // namespace
}  // namespace decant::gpu
