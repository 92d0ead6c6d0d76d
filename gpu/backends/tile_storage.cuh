/// \file
/// Which scenes run in tiles (kernels/tile_memory.cuh), by how many blocks, and their memory.
#pragma once

#include "gpu/kernels/tile_memory.cuh"

#include <algorithm>
#include <cmath>

namespace decant::gpu {
namespace {

class TileStorage {
 public:
  /// Whether the next advance runs in tiles.
  bool there() const { return blocks_ > 0 && !too_small_; }
  /// After an advance without them. Whether one runs in tiles depends on its state and nothing before, so that a resumed
  /// pour keeps its bits.
  void serve_again() { too_small_ = false; }

  void clear() {
    blocks_ = 0;
    too_small_ = false;
  }
  /// Whether a scene is to run in tiles: each of n particles has its threads at once, each block can look through all
  /// that there is, and a tile is likely to find room.
  /// \param sentinel  index beyond all particles
  /// \param reach     radius of the lists, in dx
  template <class Kernel>
  bool serve(Kernel kernel, int n, int sentinel, int containers, double reach) {
    const bool same = n == n_ && sentinel == sentinel_;
    n_ = n;
    sentinel_ = sentinel;
    if (!same) bytes_ = 0;
    constexpr int most_particles = 32 * persistent_block;
    if (n > most_blocks() * (persistent_block / TileMemory::lanes) || sentinel > most_particles) return false;
    most_bytes_ = most_shared_bytes(kernel) / 16 * 16;  // it is read by so many at a time
    if (persistent_blocks(kernel, most_bytes_) == 0) return false;
    const int blocks = wanted_blocks(n), own = (n + blocks - 1) / blocks;
    // A cube of particles and those within reach of it, walls among them; free surfaces and what is not quite a cube are
    // left to `grow`.
    const double locals = std::pow(std::cbrt(own) + 2 * reach, 3),
                 listed = 5.1 * std::pow(reach, 3) / TileMemory::lanes + 4;
    const long long wanted =
        TileMemory::bytes_of(own, static_cast<long long>(locals), 0, static_cast<long long>(std::ceil(listed / 4)),
                             TileMemory::bit_words(sentinel), containers);
    if (wanted > static_cast<long long>(most_bytes_)) return false;
    bytes_ = std::max(bytes_, whole(wanted));
    blocks_ = blocks;
    return true;
  }
  /// Memory for the scene that they serve.
  void prepare(Stream& stream, const CellTable& table) {
    const auto rows = static_cast<std::size_t>(TileOrder::rows(table));
    stream.resize(count_, rows);
    stream.resize(start_, rows);
    stream.resize(particle_, static_cast<std::size_t>(n_));
    stream.resize(terms_, static_cast<std::size_t>(n_));
    reserve();
  }
  /// Room for a tile of so many bytes; where no block has as many the advance is to run without tiles. Whether anything
  /// changed.
  bool grow(int bytes) {
    if (!there() || bytes <= bytes_) return false;
    const auto most = static_cast<int>(most_bytes_);
    too_small_ = bytes > most;
    if (!too_small_) bytes_ = std::min(whole(bytes + bytes / 16), most);
    reserve();
    return true;
  }

  TileOrder order(const CellTable& table) const { return {table, count_.get(), start_.get(), particle_.get()}; }
  float2* terms() const { return terms_.get(); }
  BlockMemory memory() const { return {host_.get(), blocks_, bytes_}; }
  std::size_t bytes() const { return count_.bytes() + start_.bytes() + particle_.bytes() + terms_.bytes(); }

 private:
  static int whole(long long bytes) { return static_cast<int>((bytes + 15) / 16 * 16); }
  /// All, or fewer where each would have less than a warp or two to do: what other threads run is beside it then.
  static int wanted_blocks(int n) {
    constexpr int least_threads = 192;
    return std::clamp(n * TileMemory::lanes / least_threads, 1, most_blocks());
  }
  void reserve() {
#ifndef __CUDACC__
    host_.resize(static_cast<std::size_t>(blocks_) * static_cast<std::size_t>(bytes_));
#endif
  }

  int n_ = 0, sentinel_ = 0;
  int blocks_ = 0, bytes_ = 0;  // 0: no tiles; of a block
  bool too_small_ = false;      // for the advance under way
  std::size_t most_bytes_ = 0;
  Buffer<int> count_, start_, particle_;
  Buffer<float2> terms_;
  Buffer<char> host_;
};

}  // namespace
}  // namespace decant::gpu
