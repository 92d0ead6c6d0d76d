/// \file
/// Tiles, for small scenes: each block of a persistent grid owns some particles that lie together. These, all that is near
/// them, and their lists are in the block's shared memory, where a neighbor is found by a local index of 16 bits. Through
/// global memory goes only what other blocks need: position and velocity after the integration, p/ρ² and 1/ρ after the
/// density.
///
/// Who owns what is decided once an advance, by a sort. Lists are rebuilt without one: each block looks through all
/// particles of the scene for those near its own, which takes little where there are few.
///
/// A thread's entries are arranged by shared-memory bank. Eight threads that read 16 bytes each are served at once
/// where they ask eight different groups of banks, and a group is the index modulo 8: so thread t has its entries of
/// group t first, then those of t + 1, and so on.
#pragma once

#include "gpu/core/persistent.cuh"
#include "gpu/kernels/neighbor_ranges.cuh"
#include "gpu/kernels/sort_sources.cuh"

namespace decant::gpu {
namespace {

/// The order of particles from which blocks take theirs: by groups of 8 × 4 × 4 cells along x, y and z, row by row in a
/// group. Every block owns as many as the others, n/blocks.
struct TileOrder {
  static constexpr int row = 8;  // cells

  CellTable table;
  int* count;     // [rows()], particles by row
  int* start;     // … and before it
  int* particle;  // [n], in this order

  DECANT_BOTH static int rows(const CellTable& t) { return t.buckets / row; }
  /// Row by row, in the order of tiles.
  DECANT_DEVICE void count_in(int k) const {
    const int bucket = bucket_of_row(k);
    count[k] = table.start[bucket + row] - table.start[bucket];
  }
  /// Particle i of a bucket.
  DECANT_DEVICE void place(int bucket, int i) const {
    const int first = bucket & ~(row - 1);
    particle[start[row_of(first)] + i - table.start[first]] = i;
  }

 private:
  // A bucket is z, y, x by bits; its row in the order of tiles is z, y, x without the last bits, and then those of z and y.
  static constexpr int low = 2;
  DECANT_DEVICE int bucket_of_row(int k) const {
    const int y = k & 3, z = k >> low & 3, group = k >> 2 * low, x_bits = table.shift_x - 3;
    const int x = group & ((1 << x_bits) - 1), above = group >> x_bits, y_bits = table.shift_y - low;
    const int high_y = above & ((1 << y_bits) - 1), high_z = above >> y_bits;
    return ((high_z << low | z) << table.shift_y | high_y << low | y) << table.shift_x | x << 3;
  }
  DECANT_DEVICE int row_of(int bucket) const {
    const int x = bucket >> 3 & ((1 << (table.shift_x - 3)) - 1),
              y = bucket >> table.shift_x & ((1 << table.shift_y) - 1);
    const int z = bucket >> (table.shift_x + table.shift_y);
    const int group = ((z >> low << (table.shift_y - low)) | y >> low) << (table.shift_x - 3) | x;
    return group << 2 * low | (z & 3) << low | (y & 3);
  }
};

/// Fluid into the order of its cells, and its indices into the order of tiles.
struct TiledFluidSource : FluidSource {
  TileOrder order;

  DECANT_DEVICE void place(int i, int id, int to, int in_bucket) const {
    FluidSource::place(i, id, to, in_bucket);
    order.place(in_bucket, to);
  }
};

/// What a block knows of its tile. Locally numbered are, in the order of their indices: the fluid, its own and others',
/// the wall particles, and the sentinel.
struct TileHeader {
  int own;                                   // particles that it owns
  int fluid;                                 // local indices of fluid are below, …
  int moving_begin, moving_end;              // … those of moving walls in this range, …
  int locals;                                // … and the sentinel's is the last
  int words;                                 // of the longest list, with four entries each
  float wall_step, wall_displacement, skin;  // of the device status
};

/// A block's memory. While the tile is made, bits for all particles of the scene are where positions are later.
struct TileMemory {
  /// Threads per particle.
#ifdef __CUDACC__
  static constexpr int lanes = 8;
#else
  static constexpr int lanes = 1;
#endif
  static constexpr int header_bytes = 64;
  static constexpr int most_words = 63;  // so that numbers of entries fit in eight bits
  static constexpr int box_particles = 8;

  TileHeader* header;
  DevicePose* poses;  // of all containers, where the last substep has left them
  float4* origin;     // of own particles: x, y, z that lists are built around, and the clearance
  Box* box;           // of every eight own particles, as far as lists reach, and of all of them
  float4* moving;     // of moving walls, from moving_begin on: where their frame has them, and their container
  float4 *position, *velocity;  // x, y, z, p/ρ², of walls 0; velocity, 1/ρ, of walls V_b; by local index
  uint2* list;                  // word w of thread t at w × threads + t
  int threads;                  // of the block's particles
  int* index;                   // of a local particle among all
  unsigned short* own;          // local index of a particle that it owns
  unsigned long long* count;    // of a thread's entries, by group of banks, eight bits each
  unsigned short* length;       // of a thread's list, in words

  DECANT_DEVICE TileMemory(char* memory, int bytes, int containers) : header(reinterpret_cast<TileHeader*>(memory)) {
    const int locals = header->locals, particles = header->own;
    threads = particles * lanes;
    poses = reinterpret_cast<DevicePose*>(memory + header_bytes);
    origin = reinterpret_cast<float4*>(memory + header_bytes + pose_bytes(containers));
    moving = origin + particles;
    position = moving + header->moving_end - header->moving_begin;
    velocity = position + locals;
    int at = bytes - threads * static_cast<int>(sizeof *count);
    count = reinterpret_cast<unsigned long long*>(memory + at);
    at -= box_bytes(particles);
    box = reinterpret_cast<Box*>(memory + at);
    at -= locals * static_cast<int>(sizeof(int));
    index = reinterpret_cast<int*>(memory + at);
    at -= (threads + particles) * static_cast<int>(sizeof *length);
    length = reinterpret_cast<unsigned short*>(memory + at);
    own = length + threads;
    list = reinterpret_cast<uint2*>(memory + at / 8 * 8) - header->words * threads;
  }
  /// Bytes that a tile needs, while it is made and afterwards.
  DECANT_BOTH static long long bytes_of(long long own, long long locals, long long moving, long long words,
                                        int bit_words, int containers) {
    const long long marks = 6LL * bit_words, state = 32 * locals;
    return header_bytes + pose_bytes(containers) + 16 * (own + moving) + (marks > state ? marks : state) + 4 * locals +
           box_bytes(static_cast<int>(own)) + 8 * (words + 1) * own * lanes + 2 * (own + own * lanes) + 16;
  }
  DECANT_BOTH static int bit_words(int sentinel) { return sentinel / 32 + 1; }
  DECANT_BOTH static int boxes(int particles) { return (particles + box_particles - 1) / box_particles; }

 private:
  DECANT_BOTH static int pose_bytes(int containers) {
    return (containers * static_cast<int>(sizeof(DevicePose)) + 15) / 16 * 16;
  }
  DECANT_BOTH static int box_bytes(int particles) { return (boxes(particles) + 1) * static_cast<int>(sizeof(Box)); }
};
static_assert(sizeof(TileHeader) <= TileMemory::header_bytes);

/// Bits of indices, and how many are set before each word of them: the local index of a particle is its rank.
struct IndexRanks {
  unsigned* bits;
  unsigned short* before;

  DECANT_DEVICE IndexRanks(const TileMemory& tile, int words)
      : bits(reinterpret_cast<unsigned*>(tile.position)), before(reinterpret_cast<unsigned short*>(bits + words)) {}
  DECANT_DEVICE void mark(int i) const { atomic_or(bits + (i >> 5), 1u << (i & 31)); }
  DECANT_DEVICE int rank(int i) const { return before[i >> 5] + bits_in(bits[i >> 5] & ((1u << (i & 31)) - 1u)); }
};

/// The tiles of a scene.
struct TileSet {
  static constexpr int lanes = TileMemory::lanes;

  Constants c;
  ParticleArrays a;
  Lists lists;
  Walls walls;
  int first_moving, moving_end;  // slots that hold all that moves
  const float4* origin;          // where lists have the fluid
  const int* particle;           // TileOrder::particle
  float2* terms;                 // [n] p/ρ², 1/ρ
  BlockMemory memory;

  DECANT_DEVICE TileMemory of(const PersistentBlock& block) const {
    return {block.memory(), memory.bytes, a.containers};
  }
  /// The particles of a block are particle[first_of(block)] on.
  DECANT_DEVICE int first_of(int block) const {
    return static_cast<int>(static_cast<long long>(a.n) * block / memory.blocks);
  }
  DECANT_DEVICE int owned_by(int block) const { return first_of(block + 1) - first_of(block); }
  DECANT_DEVICE void load_poses(const PersistentBlock& block, const TileMemory& tile, const DevicePose* from) const {
    static_assert(sizeof(DevicePose) % sizeof(float) == 0);
    block.for_each(a.containers * static_cast<int>(sizeof(DevicePose) / sizeof(float)), [&](int k) DECANT_INLINE {
      reinterpret_cast<float*>(tile.poses)[k] = reinterpret_cast<const float*>(from)[k];
    });
  }
};

}  // namespace
}  // namespace decant::gpu
