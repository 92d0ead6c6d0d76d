/// \file
/// What an advance or an evaluation begins with, in one kernel, since launches take longer than what they launch there.
#pragma once

#include "gpu/core/stream.cuh"
#include "gpu/kernels/place_walls.cuh"
#include "gpu/kernels/store_state.cuh"

#include <algorithm>

namespace decant::gpu {
namespace {

/// Nothing has happened yet, neighbors are to be looked for, and walls are in their place. The state is kept, if it may
/// be needed again.
struct Begin {
  ParticleArrays a;
  PlaceWalls<WallsFor::start> place_walls;
  int wall_slots;
  bool keeps_state;
  CopyState keep;
  int* blocks_ended;  // 0 before and after

  int threads() const { return std::max({1, a.n, wall_slots}); }
  DECANT_DEVICE void operator()(int k) const {
    if (keeps_state && k < a.n) keep(k);
    if (k < wall_slots) place_walls(k);
  }
  DECANT_DEVICE void end() const {
    DeviceStatus status{};
    status.non_finite = status.escaped = status.missed_pair = DeviceStatus::none;
    status.rebuild_needed = 1;
    *a.status = status;
  }
};

/// What a neighbor search adds: looks at every particle, and then decides.
struct NothingToDecide {
  DECANT_DEVICE void look_at(int) const {}
  DECANT_DEVICE void decide() const {}
};

template <class Search>
DECANT_KERNEL(256)
begin_kernel(int n, Begin begin, Search search) {
  for_each_thread(n, [&](int k) {
    begin(k);
    if (k < begin.a.n) search.look_at(k);
  });
  by_last_block(begin.blocks_ended, [&] {
    begin.end();
    search.decide();
  });
}

template <class Search = NothingToDecide>
void launch_begin(Stream& stream, const Begin& begin, const Search& search = {}) {
  stream.launch(begin_kernel<Search>, begin.threads(), begin, search);
}

}  // namespace
}  // namespace decant::gpu
