/// \file
/// Bringing things into the order of their cells. Two ways: a counting sort, which is what the table
/// of cells needs anyway, and Thrust's sort by key, as published codes do. Inside a cell the order is
/// that of the ids, so that it depends on where things are and not on where they have been.
///
/// A Source tells position(i) and id(i) of thing i, and place(i, id, to, bucket) moves it; rank(i) is a
/// number of its own below the count of things, in the order of the ids; begin() is called once, by
/// whoever comes first; scratch() is memory for the sort, of no use to others meanwhile.
#pragma once

#include "gpu/core/cell_table.cuh"
#include "gpu/core/stream.cuh"

namespace decant::gpu {
namespace {

/// Device memory that a sort needs; several sorts one after the other may share one.
struct SortScratch {
  static constexpr int scan_padding = 4;  // scans read and write whole fours

  Buffer<int> key, slot;
  Buffer<char> scan;

  void reserve(int things, int buckets) {
    const auto n = static_cast<std::size_t>(things);
    if (key.size() < n) {
      key.resize(n);
      slot.resize(n);
    }
    Stream::reserve_scan(buckets + 1, scan);
    constexpr std::size_t sums = most_persistent_blocks * sizeof(int);
    if (scan.bytes() < sums) scan.resize(sums);
  }
  std::size_t bytes() const { return key.bytes() + slot.bytes() + scan.bytes(); }
};

/// First step of a counting sort: the bucket of each thing, and how many came before it there, in any order.
template <class Source>
struct CountInCells {
  CellTable table;
  Source source;
  int *key, *slot, *count;

  DECANT_DEVICE void operator()(int i) const { count_in(i, source.position(i)); }
  DECANT_DEVICE void count_in(int i, Float3 x) const {
    const int bucket = table.bucket_of(x);
    key[i] = bucket;
    slot[i] = atomic_increment(count + bucket);
  }
};
template <class Source>
DECANT_KERNEL(256)
count_in_cells_kernel(int n, CountInCells<Source> count) {
  for_each_thread(n, count);
}

/// Second step, after a scan of the counts: (id, index) to a place in the bucket.
template <class Source>
struct ScatterIntoCells {
  Source source;
  const int *key, *slot, *start;
  int* count;
  int2* at;

  DECANT_DEVICE void operator()(int i) const {
    if (i == 0) source.begin();
    if (slot[i] == 0) count[key[i]] = 0;  // for the next sort
    at[start[key[i]] + slot[i]] = make_int2(source.id(i), i);
  }
};
template <class Source>
DECANT_KERNEL(256)
scatter_into_cells_kernel(int n, ScatterIntoCells<Source> scatter) {
  for_each_thread(n, scatter);
}

/// Third step: slots were given in any order; the rank of an id among those of its cell is its place.
template <class Source>
struct OrderByIdInCell {
  Source source;
  const int *key, *start;
  const int2* at;

  DECANT_DEVICE void operator()(int t) const {
    const int2 own = at[t];
    const int bucket = key[own.y], end = start[bucket + 1];
    int to = start[bucket];
    for (int other = to; other < end; ++other) to += at[other].x < own.x;
    source.place(own.y, own.x, to, bucket);
  }
};
template <class Source>
DECANT_KERNEL(256)
order_by_id_in_cell_kernel(int n, OrderByIdInCell<Source> order) {
  for_each_thread(n, order);
}

/// First step of Thrust's sort: keys and indices in the order of the ids.
template <class Source>
struct ComputeCellKeys {
  CellTable table;
  Source source;
  int *key, *index;

  DECANT_DEVICE void operator()(int i) const {
    if (i == 0) source.begin();
    // The sort is stable: what is first in the order of ids stays so in its cell.
    const int rank = source.rank(i);
    key[rank] = table.bucket_of(source.position(i));
    index[rank] = i;
  }
};
template <class Source>
DECANT_KERNEL(256)
compute_cell_keys_kernel(int n, ComputeCellKeys<Source> compute) {
  for_each_thread(n, compute);
}

struct CopyIds {
  const int* id;
  int* kept;
  DECANT_DEVICE void operator()(int i) const { kept[i] = id[i]; }
};
DECANT_KERNEL(256) copy_ids_kernel(int n, CopyIds copy) { for_each_thread(n, copy); }

/// Its last step: things to where their keys are now.
template <class Source>
struct PlaceSorted {
  Source source;
  const int *key, *index, *id;

  DECANT_DEVICE void operator()(int t) const { source.place(index[t], id[index[t]], t, key[t]); }
};
template <class Source>
DECANT_KERNEL(256)
place_sorted_kernel(int n, PlaceSorted<Source> place) {
  for_each_thread(n, place);
}

/// The table of cells of n things, and the things in its order.
class CellSort {
 public:
  void prepare(Stream& stream, const CellTable& table, int n, SortScratch& scratch) {
    table_ = table;
    stream.resize(start_, static_cast<std::size_t>(table.buckets) + SortScratch::scan_padding);
    stream.resize(count_, static_cast<std::size_t>(table.buckets) + SortScratch::scan_padding);
    table_.start = start_.get();
    scratch.reserve(n, table.buckets);
    clear(stream);
  }
  const CellTable& table() const { return table_; }
  /// Never sorts again.
  void keep_table_alone() { count_.resize(0); }
  std::size_t bytes() const { return start_.bytes() + count_.bytes(); }

  template <class Source>
  void sort_by_counting(Stream& stream, int n, const Source& source, SortScratch& s) {
    stream.launch(count_in_cells_kernel<Source>, n, counter(source, s));
    place_counted(stream, n, source, s);
  }

  /// The same in parts, for whoever counts on the way: counter(…).count_in(i, x) for all, and
  /// place_counted, which leaves nothing counted; `clear` forgets what was.
  void clear(Stream& stream) { stream.fill_zero(count_.get(), count_.bytes()); }
  template <class Source>
  CountInCells<Source> counter(const Source& source, SortScratch& s) const {
    return {table_, source, s.key.get(), s.slot.get(), count_.get()};
  }
  template <class Source>
  ScatterIntoCells<Source> scatter(const Source& source, SortScratch& s) const {
    return {source, s.key.get(), s.slot.get(), start_.get(), count_.get(), source.scratch()};
  }
  template <class Source>
  OrderByIdInCell<Source> order(const Source& source, SortScratch& s) const {
    return {source, s.key.get(), start_.get(), source.scratch()};
  }
  const int* counts() const { return count_.get(); }
  int* starts() const { return start_.get(); }
  template <class Source>
  void place_counted(Stream& stream, int n, const Source& source, SortScratch& s) const {
    stream.exclusive_scan(count_.get(), start_.get(), table_.buckets + 1, s.scan);
    stream.launch(scatter_into_cells_kernel<Source>, n, scatter(source, s));
    stream.launch(order_by_id_in_cell_kernel<Source>, n, order(source, s));
  }

  /// \param id  of each thing
  template <class Source>
  void sort_by_key(Stream& stream, int n, const Source& source, const int* id, SortScratch& s) {
    int* kept = reinterpret_cast<int*>(source.scratch());
    stream.launch(compute_cell_keys_kernel<Source>, n,
                  ComputeCellKeys<Source>{table_, source, s.key.get(), s.slot.get()});
    stream.launch(copy_ids_kernel, n, CopyIds{id, kept});
    stream.sort_by_key(s.key.get(), s.slot.get(), n);
    stream.lower_bounds(s.key.get(), n, start_.get(), table_.buckets + 1);
    stream.launch(place_sorted_kernel<Source>, n, PlaceSorted<Source>{source, s.key.get(), s.slot.get(), kept});
  }

 private:
  CellTable table_{};
  Buffer<int> start_, count_;
};

}  // namespace
}  // namespace decant::gpu
