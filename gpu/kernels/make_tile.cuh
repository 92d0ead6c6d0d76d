/// \file
/// How a block makes its tile (tile_memory.cuh): it looks through all particles of the scene for those near its own,
/// numbers them, and tests each of its own with all of these.
#pragma once

#include "gpu/kernels/tile_memory.cuh"

namespace decant::gpu {
namespace {

struct MakeTile : TileSet {
  /// The tile of a block, for particles where they are. Where its memory does not suffice the block owns none, and the
  /// status says how much would.
  DECANT_DEVICE void operator()(const PersistentBlock& block) const {
    TileHeader& header = *reinterpret_cast<TileHeader*>(block.memory());
    const int words = TileMemory::bit_words(a.sentinel);
    const int first = first_of(block.number()), own = owned_by(block.number());
    const float reach = c.H + a.status->skin;
    block.sync();
    block.once([&] {
      header = {};
      header.own = own;
    });
    block.sync();
    if (!fits(block, header, words)) return;
    TileMemory tile = of(block);
    const IndexRanks ranks(tile, words);
    load_poses(block, tile, a.poses_before());
    block.for_each(words, [&](int w) DECANT_INLINE { ranks.bits[w] = 0; });
    block.for_each(own, [&](int k) DECANT_INLINE {
      const int i = particle[first + k];
      const float4 x = origin[i];
      tile.origin[k] = make_float4(x.x, x.y, x.z, a.current.velocity[i].w);
    });
    block.sync();
    enclose(block, tile, reach);
    mark_near(block, tile, ranks, reach);
    block.for_each(own, [&](int k) DECANT_INLINE { ranks.mark(particle[first + k]); });
    block.once([&] { ranks.mark(a.sentinel); });
    block.sync();
    const int locals = block.exclusive_scan(
        words, [&](int w) DECANT_INLINE { return bits_in(ranks.bits[w]); },
        [&](int w, int before) DECANT_INLINE { ranks.before[w] = static_cast<unsigned short>(before); });
    block.once([&] {
      header.locals = locals;
      header.fluid = ranks.rank(a.base);
    });
    block.sync();
    if (!fits(block, header, words)) return;
    tile = of(block);
    const int moving_begin = ranks.rank(a.base + first_moving), moving = ranks.rank(a.base + moving_end) - moving_begin;
    block.for_each(words, [&](int w) DECANT_INLINE {
      int to = ranks.before[w];
      for (unsigned rest = ranks.bits[w]; rest; rest &= rest - 1) tile.index[to++] = 32 * w + lowest_bit(rest);
    });
    block.for_each(
        own, [&](int k) DECANT_INLINE { tile.own[k] = static_cast<unsigned short>(ranks.rank(particle[first + k])); });
    block.sync();
    block.once([&] {
      header.moving_begin = moving_begin;
      header.moving_end = moving_begin + moving;
    });
    block.sync();
    if (!fits(block, header, words)) return;
    tile = of(block);
    block.for_each(moving, [&](int k) DECANT_INLINE {
      const int slot = tile.index[moving_begin + k] - a.base;
      const float4 x = walls.local[slot];
      tile.moving[k] = make_float4(x.x, x.y, x.z, static_cast<float>(walls.container[slot]));
    });
    block.template copy<2>(
        locals,
        [&](int l) DECANT_INLINE {
          const int j = tile.index[l];
          return (j < a.base ? origin : a.current.position)[j];
        },
        [&](int l, float4 x) DECANT_INLINE {
          tile.position[l] = make_float4(x.x, x.y, x.z, 0.0f);
          if (l >= tile.header->fluid) tile.velocity[l] = a.force_velocity[tile.index[l]];
        });
    block.sync();
    block.for_each(tile.threads, [&](int t) DECANT_INLINE {
      int found = 0;
      unsigned long long count = 0;
      each_within(tile, t, reach, [&](int l) DECANT_INLINE {
        count += 1ull << 8 * (l & 7);
        ++found;
      });
      tile.count[t] = count;
      tile.length[t] = static_cast<unsigned short>((found + 3) / 4);
      if (tile.length[t] > atomic_load(&header.words)) atomic_maximum(&header.words, tile.length[t]);
    });
    block.sync();
    if (!fits(block, header, words)) return;
    tile = of(block);
    block.for_each(tile.threads, [&](int t) DECANT_INLINE { arrange(tile, t, reach); });
    block.sync();
  }

 private:
  /// Boxes around own particles; no particle outside of all of them is in a list.
  DECANT_DEVICE void enclose(const PersistentBlock& block, const TileMemory& tile, float reach) const {
    const int own = tile.header->own, boxes = TileMemory::boxes(own);
    block.for_each(boxes + 1, [&](int b) DECANT_INLINE {
      constexpr float far = 3.0e38f;
      const int begin = b < boxes ? b * TileMemory::box_particles : 0;
      const int end = b < boxes && begin + TileMemory::box_particles < own ? begin + TileMemory::box_particles : own;
      Float3 low{far, far, far}, high{-far, -far, -far};
      for (int k = begin; k < end; ++k) {
        const Float3 x = xyz(tile.origin[k]);
        low = {fminf(low.x, x.x), fminf(low.y, x.y), fminf(low.z, x.z)};
        high = {fmaxf(high.x, x.x), fmaxf(high.y, x.y), fmaxf(high.z, x.z)};
      }
      // What rounding takes from it.
      const auto margin = [&](float from, float to) {
        return 1.0001f * reach + 0x1p-22f * fmaxf(fabsf(from), fabsf(to));
      };
      const Float3 outward{margin(low.x, high.x), margin(low.y, high.y), margin(low.z, high.z)};
      tile.box[b] = {low - outward, high + outward};
    });
    block.sync();
  }
  /// All that some list will hold.
  DECANT_DEVICE void mark_near(const PersistentBlock& block, const TileMemory& tile, const IndexRanks& ranks,
                               float reach) const {
    const int own = tile.header->own, boxes = TileMemory::boxes(own), slots = a.sentinel - a.base;
    const float reach2 = squared_reach(reach);
    const Box all = tile.box[boxes];
    const auto near = [&](Float3 x) DECANT_INLINE {
      for (int b = 0; b < boxes; ++b) {
        if (!tile.box[b].holds(x)) continue;
        bool within = false;
#pragma unroll
        for (int k = 0; k < TileMemory::box_particles; ++k) {
          const int number = b * TileMemory::box_particles + k;
          const Float3 d = xyz(tile.origin[number < own ? number : own - 1]) - x;
          within |= square_of(d) < reach2;
        }
        if (within) return true;
      }
      return false;
    };
    block.template copy<4>(
        a.n + slots, [&](int k) DECANT_INLINE { return k < a.n ? origin[k] : a.current.position[a.base + k - a.n]; },
        [&](int k, float4 position) DECANT_INLINE {
          const Float3 x = xyz(position);
          if (all.holds(x) && near(x)) ranks.mark(k < a.n ? k : a.base + k - a.n);
        });
  }
  /// Of lists; without skin exactly what the kernels take for a neighbor.
  DECANT_DEVICE float squared_reach(float reach) const { return reach * reach > c.H2 ? reach * reach : c.H2; }
  /// Whether a tile finds room, as far as it is known; if not the block owns none.
  DECANT_DEVICE bool fits(const PersistentBlock& block, TileHeader& header, int bit_words) const {
    const long long needed = TileMemory::bytes_of(header.own, header.locals, header.moving_end - header.moving_begin,
                                                  header.words, bit_words, a.containers);
    const bool numbered = header.locals < 0xFFFF && header.words <= TileMemory::most_words;
    if (needed <= memory.bytes && numbered) return true;
    block.sync();
    block.once([&] {
      atomic_maximum(&a.status->tile_bytes, numbered ? static_cast<int>(needed) : DeviceStatus::never);
      header = {};
    });
    block.sync();
    return false;
  }
  /// body(l) for thread t's share of what a list holds of its particle.
  template <class Body>
  DECANT_DEVICE void each_within(const TileMemory& tile, int t, float reach, Body&& body) const {
    const float reach2 = squared_reach(reach);
    const int own = tile.own[t / lanes], end = tile.header->locals - 1;
    const Float3 x = xyz(tile.origin[t / lanes]);
#pragma unroll 4
    for (int l = t % lanes; l < end; l += lanes) {
      const Float3 d = x - xyz(tile.position[l]);
      if (square_of(d) < reach2 && l != own) body(l);
    }
  }
  /// List t, in the order of its groups of banks.
  DECANT_DEVICE void arrange(const TileMemory& tile, int t, float reach) const {
    using Counts = unsigned long long;  // of eight groups, eight bits each
    const Counts count = tile.count[t];
    Counts place = 0, before = 0;
#pragma unroll
    for (int k = 0; k < 8; ++k) {
      const int group = 8 * ((t + k) & 7);
      place |= before << group;
      before += count >> group & 0xFF;
    }
    unsigned short* to = reinterpret_cast<unsigned short*>(tile.list + t);
    const auto put = [&](int at, int l)
                         DECANT_INLINE { to[at / 4 * 4 * tile.threads + at % 4] = static_cast<unsigned short>(l); };
    each_within(tile, t, reach, [&](int l) DECANT_INLINE {
      const int group = 8 * (l & 7);
      put(static_cast<int>(place >> group & 0xFF), l);
      place += Counts{1} << group;
    });
    for (int at = static_cast<int>(before); at % 4 != 0; ++at) put(at, tile.header->locals - 1);
  }
};

}  // namespace
}  // namespace decant::gpu
