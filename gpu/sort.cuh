/// \file
/// Bringing things into the order of their cells. Two ways: a counting sort, which is what the table
/// of cells needs anyway, and Thrust's sort by key, as published codes do. Inside a cell the order is
/// that of the ids, so that it depends on where things are and not on where they have been.
///
/// A Source tells position(i) and id(i) of thing i, and place(i, id, to, bucket) puts it; rank(i) is a
/// number of its own below the count of things, in the order of the ids; begin() is called once, by
/// whoever comes first; desk() is memory for the sort, of no use to others meanwhile.
#pragma once

#include "gpu/cells.cuh"
#include "gpu/queue.cuh"
#include "gpu/steps.cuh"

namespace decant::gpu::DECANT_EXECUTOR {

/// Device memory that a sort needs; several sorts one after the other may share one.
struct SortScratch {
  Buffer<int> key, slot;
  Buffer<char> scan;

  void reserve(int things, int buckets) {
    const auto n = static_cast<std::size_t>(things);
    if (key.size() < n) {
      key.resize(n);
      slot.resize(n);
    }
    Queue::reserve_scan(buckets + 1, scan);
    constexpr std::size_t shares = PrefixSum::most_shares * sizeof(int);
    if (scan.bytes() < shares) scan.resize(shares);
  }
  std::size_t bytes() const { return key.bytes() + slot.bytes() + scan.bytes(); }
};

template <class Source>
struct KeyPass {
  CellTable table;
  Source source;
  int *key, *slot, *count;

  DECANT_DEVICE void operator()(int i) const {
    count_in(i, source.position(i));
  }
  DECANT_DEVICE void count_in(int i, Float3 x) const {
    const int bucket = table.bucket_of(x);
    key[i] = bucket;
    slot[i] = atomic_increment(count + bucket);
  }
};

template <class Source>
struct ScatterPass {
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

/// Slots were given in any order; the rank of an id among those of its cell is its place.
template <class Source>
struct PlacePass {
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
struct PlainKeyPass {
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

struct KeepIdPass {
  const int* id;
  int* kept;
  DECANT_DEVICE void operator()(int i) const { kept[i] = id[i]; }
};

template <class Source>
struct PlaceSortedPass {
  Source source;
  const int *key, *index, *id;

  DECANT_DEVICE void operator()(int t) const { source.place(index[t], id[index[t]], t, key[t]); }
};

/// The table of cells of n things, and the things in its order.
class CellSort {
 public:
  void prepare(Queue& queue, const CellTable& table, int n, SortScratch& scratch) {
    table_ = table;
    start_.resize(static_cast<std::size_t>(table.buckets) + PrefixSum::more_room);
    count_.resize(static_cast<std::size_t>(table.buckets) + PrefixSum::more_room);
    table_.start = start_.get();
    scratch.reserve(n, table.buckets);
    clear(queue);
  }
  const CellTable& table() const { return table_; }
  /// Never sorts again.
  void keep_table_alone() { count_.resize(0); }
  std::size_t bytes() const { return start_.bytes() + count_.bytes(); }

  template <class Source>
  void counting(Queue& queue, int n, const Source& source, SortScratch& s) {
    start(queue, count(n, source, s));
    start(queue, place_counted(n, source, s));
  }

  /// The same in parts, for whoever counts on the way: counter(…).count_in(i, x) for all, and
  /// place_counted, which leaves nothing counted; `clear` forgets what was.
  void clear(Queue& queue) { queue.fill_zero(count_.get(), count_.bytes()); }
  template <class Source>
  KeyPass<Source> counter(const Source& source, SortScratch& s) const {
    return {table_, source, s.key.get(), s.slot.get(), count_.get()};
  }
  template <class Source>
  auto count(int n, const Source& source, SortScratch& s) const {
    return Each<KeyPass<Source>>{n, counter(source, s)};
  }
  template <class Source>
  auto place_counted(int n, const Source& source, SortScratch& s) const {
    return in_order(
        PrefixSum{count_.get(), start_.get(), table_.buckets + 1, &s.scan,
                  reinterpret_cast<int*>(s.scan.get())},
        Each<ScatterPass<Source>>{n, {source, s.key.get(), s.slot.get(), start_.get(), count_.get(),
                                      source.desk()}},
        Each<PlacePass<Source>>{n, {source, s.key.get(), start_.get(), source.desk()}});
  }

  template <class Source>
  void thrust(Queue& queue, int n, const Source& source, const int* id, SortScratch& s) {
    int* kept = reinterpret_cast<int*>(source.desk());
    queue.for_each(n, PlainKeyPass<Source>{table_, source, s.key.get(), s.slot.get()});
    queue.for_each(n, KeepIdPass{id, kept});
    queue.sort_by_key(s.key.get(), s.slot.get(), n);
    queue.lower_bounds(s.key.get(), n, start_.get(), table_.buckets + 1);
    queue.for_each(n, PlaceSortedPass<Source>{source, s.key.get(), s.slot.get(), kept});
  }

 private:
  CellTable table_{};
  Buffer<int> start_, count_;
};

}  // namespace decant::gpu::DECANT_EXECUTOR
