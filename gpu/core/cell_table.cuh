/// \file
/// The spatial hash: a grid of cells folded onto a table that is periodic in each axis. Cell (x, y, z)
/// lives in bucket (x mod wx, y mod wy, z mod wz), so memory is bounded wherever particles are, and
/// the cells of a row along x are one range of the sorted particles. Cells that share a bucket cost
/// distance tests and never change an answer; wx >= 8, wy, wz >= 4 keep the cells around a particle in
/// buckets of their own. On a periodic axis of the scene the table wraps where the scene does.
#pragma once

#include "gpu/core/particle_arrays.cuh"

#include <cmath>

namespace decant::gpu {
namespace {

struct CellTable {
  int wrap[3];  // cells an axis before it repeats; on a free axis a power of two
  bool free_axis[3];
  int shift_x, shift_y;  // bucket = z << (shift_x + shift_y) | y << shift_x | x
  double inverse_cell[3];
  double origin[3];  // where cell 0 begins
  int buckets;
  const int* start;  // [buckets + 1] first particle of each bucket

  /// Bucket of a point; 0 where it has no cell (not finite, or 10⁹ cells away).
  DECANT_DEVICE int bucket_of(Float3 x) const {
    const int cx = wrapped_cell(0, cell(0, x.x)), cy = wrapped_cell(1, cell(1, x.y));
    return (((wrapped_cell(2, cell(2, x.z)) << shift_y) | cy) << shift_x) | cx;
  }

  /// Sorted particles [begin, end) and, where a row goes around the table's end, [begin2, end2).
  struct Range {
    int begin, end, begin2, end2;
  };
  /// Row k of nine that together cover all within reach of any point in a bucket's cell. Cells are half
  /// a reach long in x, so a row is two and a half reaches instead of three. (Cutting rows to the chord
  /// of the sphere halves the candidates of one particle, but not the longest row in a warp.) The even
  /// ones, the middle and the corners, hold about as many neighbors as the odd ones.
  template <bool periodic>
  DECANT_DEVICE Range row(int bucket, int k) const {
    const int d = static_cast<int>(0x876523014ull >> (4 * k) & 0xF);
    const Cell c = cell_of(bucket);
    int y, z;
    if constexpr (periodic) {
      if (!neighbor_row(1, c.y, d % 3 - 1, y) || !neighbor_row(2, c.z, d / 3 - 1, z)) return {0, 0, 0, 0};
    } else {
      y = (c.y + d % 3 - 1) & (wrap[1] - 1);
      z = (c.z + d / 3 - 1) & (wrap[2] - 1);
    }
    const int at = ((z << shift_y) | y) << shift_x;
    if (wrap[0] <= 5) return {start[at], start[at + wrap[0]], 0, 0};
    const int first = around_end(c.x - 2, wrap[0]), spill = first + 5 - wrap[0];
    if (spill <= 0) return {start[at + first], start[at + first + 5], 0, 0};
    return {start[at + first], start[at + wrap[0]], start[at], start[at + spill]};
  }
  /// Whether its rows go around the table's end.
  DECANT_DEVICE bool goes_around(int bucket) const {
    return wrap[0] > 5 && around_end(cell_of(bucket).x - 2, wrap[0]) + 5 > wrap[0];
  }
  static constexpr int rows = 9;
  /// Cells that a reach spans along an axis, beyond the one it begins in.
  DECANT_BOTH static int beyond(int axis) { return axis == 0 ? 2 : 1; }
  /// Whether a bucket is a cell's, and no padding of the table's.
  DECANT_BOTH bool in_table(int bucket) const {
    const Cell c = cell_of(bucket);
    return c.x < wrap[0] && c.y < wrap[1] && c.z < wrap[2];
  }

  /// Distance² of a point from a bucket's cell, where the cells of all things lie side by side in the
  /// table, `used` cells an axis from the origin on; what is within reach of them is few cells beyond, so
  /// cells farther on are before the origin.
  DECANT_DEVICE float distance2(int bucket, const int used[3], Float3 x) const {
    const Cell c = cell_of(bucket);
    const auto off = [&](int axis, int at, float to) {
      const int cell = at >= used[axis] + beyond(axis) ? at - wrap[axis] : at;
      const double low = origin[axis] + cell / inverse_cell[axis];
      const double high = origin[axis] + (cell + 1) / inverse_cell[axis];
      return to < low ? low - to : to > high ? to - high : 0.0;
    };
    const double dx = off(0, c.x, x.x), dy = off(1, c.y, x.y), dz = off(2, c.z, x.z);
    return static_cast<float>(dx * dx + dy * dy + dz * dz);
  }

  /// Super-cells are two reaches an axis; their numbers are packed as buckets are.
  DECANT_DEVICE int super_of(int bucket) const {
    const Cell c = cell_of(bucket);
    return (((c.z >> 1) << super_shift_y()) | (c.y >> 1)) << super_shift_x() | (c.x >> 2);
  }
  DECANT_BOTH int supers() const { return ((wrap[2] + 1) / 2) << (super_shift_x() + super_shift_y()); }
  /// each(super) for a super-cell and those around it; one may come more than once.
  template <class Each>
  DECANT_DEVICE void supers_around(int super, Each&& each) const {
    const int sx = super_shift_x(), sy = super_shift_y();
    const int nx = (wrap[0] + 3) / 4, ny = (wrap[1] + 1) / 2, nz = (wrap[2] + 1) / 2;
    const int x = super & ((1 << sx) - 1), y = (super >> sx) & ((1 << sy) - 1);
    const int z = super >> (sx + sy);
#pragma unroll 9
    for (int d = 0; d < 27; ++d)
      each((around_end(z + d / 9 - 1, nz) << sy | around_end(y + d / 3 % 3 - 1, ny)) << sx |
           around_end(x + d % 3 - 1, nx));
  }

 private:
  struct Cell {
    int x, y, z;
  };
  DECANT_BOTH Cell cell_of(int bucket) const {
    return {bucket & ((1 << shift_x) - 1), (bucket >> shift_x) & ((1 << shift_y) - 1), bucket >> (shift_x + shift_y)};
  }
  DECANT_BOTH int super_shift_x() const { return shift_x > 2 ? shift_x - 2 : 0; }
  DECANT_BOTH int super_shift_y() const { return shift_y > 1 ? shift_y - 1 : 0; }
  DECANT_DEVICE static int around_end(int c, int count) { return c < 0 ? c + count : c >= count ? c - count : c; }
  /// In double: whatever the offset, particles within reach of each other are in cells side by side.
  DECANT_DEVICE double cell(int axis, float x) const {
    const double s = floor((static_cast<double>(x) - origin[axis]) * inverse_cell[axis]);
    return s > -1e9 && s < 1e9 ? s : 0.0;
  }
  DECANT_DEVICE int wrapped_cell(int axis, double s) const {
    const int c = static_cast<int>(s);
    if (free_axis[axis]) return c & (wrap[axis] - 1);
    const int rest = c % wrap[axis];
    return rest < 0 ? rest + wrap[axis] : rest;
  }
  /// An axis of one or two cells has no third one to visit.
  DECANT_DEVICE bool neighbor_row(int axis, int c, int offset, int& to) const {
    if (wrap[axis] >= 3) {
      to = around_end(c + offset, wrap[axis]);
      return true;
    }
    to = offset;
    return offset >= 0 && offset < wrap[axis];
  }
};

/// A table whose cells are at least `reach` wide, for points within [low, high] as a rule, with about
/// `most` buckets at most.
inline CellTable make_cell_table(const Constants& c, double reach, const double low[3], const double high[3],
                                 double most) {
  CellTable t{};
  double wanted[3];
  for (int a = 0; a < 3; ++a) {
    // A pair just within reach by fp32 must not be two cells apart.
    const double cell = reach * (1 + 0x1p-16) / (a == 0 ? 2 : 1);
    if (c.periodic[a]) {
      const double period = c.period[a];
      const double super = a == 0 ? 4 : 2;
      double cells = std::fmin(std::fmax(std::floor(period / cell), 1.0), 1024.0);
      if (cells > 3 * super) cells = super * std::floor(cells / super);  // whole super-cells
      t.wrap[a] = static_cast<int>(cells);
      t.inverse_cell[a] = cells / period;
      t.origin[a] = c.domain_min[a];
      wanted[a] = 0;
      continue;
    }
    t.free_axis[a] = true;
    t.inverse_cell[a] = 1 / cell;
    t.origin[a] = std::floor(low[a] / cell) * cell;
    t.wrap[a] = a == 0 ? 8 : 4;
    const double extent = (high[a] - low[a]) / cell;
    wanted[a] = extent > 4 ? extent + 12 : 4;  // NaN: 4
  }
  const auto buckets = [&] { return double(t.wrap[0]) * t.wrap[1] * t.wrap[2]; };
  for (;;) {
    int widest = -1;
    for (int a = 0; a < 3; ++a)
      if (t.wrap[a] < wanted[a] && (widest < 0 || wanted[a] / t.wrap[a] > wanted[widest] / t.wrap[widest])) widest = a;
    if (widest < 0 || 2 * buckets() > most) break;
    t.wrap[widest] *= 2;
  }
  const auto shift_of = [](int n) {
    int shift = 0;
    while ((1 << shift) < n) ++shift;
    return shift;
  };
  t.shift_x = shift_of(t.wrap[0]);
  t.shift_y = shift_of(t.wrap[1]);
  t.buckets = t.wrap[2] << (t.shift_x + t.shift_y);
  return t;
}

}  // namespace
}  // namespace decant::gpu
