/// \file
/// Work as values: what runs over how many things, and in which order. An executor can start such steps
/// one by one (queue.cuh), or repeat all of a substep in one launch (crew.cuh).
#pragma once

#include "gpu/exec.cuh"

#include <algorithm>

namespace decant::gpu::DECANT_EXECUTOR {

/// body(i) for i in 0 … n−1.
template <class Body>
struct Each {
  int n;
  Body body;
};

/// body(group), a Group of so many lanes, for particles 0 … n−1.
template <int lanes, class Body>
struct EachGroup {
  int n;
  Body body;
};
template <int lanes, class Body>
EachGroup<lanes, Body> each_group(int n, const Body& body) {
  return {n, body};
}

/// out[k] = in[0] + … + in[k−1], k < n. Both have room for whole fours; what `in` has there is nothing.
struct PrefixSum {
  static constexpr int more_room = 4;
  static constexpr int most_shares = 1024;
  const int* in;
  int* out;
  int n;
  Buffer<char>* scratch;  // of the host's to know
  int* shares;            // the same memory: one for each block of a crew
};

/// One step after the other.
template <class... Steps>
struct InOrder {};
template <class First, class... Rest>
struct InOrder<First, Rest...> {
  First first;
  InOrder<Rest...> rest;
};
inline InOrder<> in_order() { return {}; }
template <class First, class... Rest>
InOrder<First, Rest...> in_order(const First& first, const Rest&... rest) {
  return {first, in_order(rest...)};
}

/// Steps of which neither reads or writes what the other one writes: nobody need wait between them.
template <class First, class Second>
struct Beside {
  First first;
  Second second;
};

/// Starts a step, launch by launch.
template <class Queue, class Body>
void start(Queue& queue, const Each<Body>& step) {
  queue.for_each(step.n, step.body);
}
template <class Queue, int lanes, class Body>
void start(Queue& queue, const EachGroup<lanes, Body>& step) {
  queue.template for_each_group<lanes>(step.n, step.body);
}
template <class Queue>
void start(Queue& queue, const PrefixSum& step) {
  queue.exclusive_scan(step.in, step.out, step.n, *step.scratch);
}
template <class Queue, class First, class Second>
void start(Queue& queue, const Beside<First, Second>& steps) {
  start(queue, steps.first);
  start(queue, steps.second);
}
template <class Queue>
void start(Queue&, const InOrder<>&) {}
template <class Queue, class First, class... Rest>
void start(Queue& queue, const InOrder<First, Rest...>& steps) {
  start(queue, steps.first);
  start(queue, steps.rest);
}

/// Bytes of shared memory that a body wants for a block of so many threads; a step, that its bodies want.
template <int lanes, class Body>
constexpr std::size_t desk_bytes(int threads) {
  if constexpr (requires { Body::template desk_bytes<lanes>(threads); })
    return Body::template desk_bytes<lanes>(threads);
  else
    return 0;
}
template <class Body>
std::size_t desk_bytes(const Each<Body>&, int) {
  return 0;
}
template <int lanes, class Body>
std::size_t desk_bytes(const EachGroup<lanes, Body>&, int threads) {
  return desk_bytes<lanes, Body>(threads);
}
inline std::size_t desk_bytes(const PrefixSum&, int) { return 0; }
template <class First, class Second>
std::size_t desk_bytes(const Beside<First, Second>& steps, int threads) {
  return std::max(desk_bytes(steps.first, threads), desk_bytes(steps.second, threads));
}
inline std::size_t desk_bytes(const InOrder<>&, int) { return 0; }
template <class First, class... Rest>
std::size_t desk_bytes(const InOrder<First, Rest...>& steps, int threads) {
  return std::max(desk_bytes(steps.first, threads), desk_bytes(steps.rest, threads));
}

/// What a substep consists of.
template <class Build, class Density, class Move>
struct Substep {
  const int* stale;      // `build` runs where this is not 0 by then
  Build build;
  Density density;
  Move move;
  long long* stage_ns;   // [3] of the device's: the time that each of the three took, added up
};

}  // namespace decant::gpu::DECANT_EXECUTOR
