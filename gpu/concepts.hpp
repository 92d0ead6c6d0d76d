/// \file
/// What a backend offers, checked by the compiler: a NeighborRange visits the neighbors of a particle, a
/// NeighborSearch makes such ranges. core/solver.cuh makes a solver of a search; kernels/ sum over ranges.
#pragma once

#include "gpu/kernels/begin.cuh"
#include "gpu/solver/context.cuh"

#include <concepts>

namespace decant::gpu {
namespace {

/// What a kernel does with a neighbor, for the compiler to try.
struct VisitArchetype {
  DECANT_BOTH void operator()(int, int, float4, Float3, float) const {}
};

/// range.for_each(team, x, positions, visit) calls visit(k, j, positions[j], d, r2) once for every particle
/// j ≠ i with r < H, fluid (j < ParticleArrays::base) and wall, of each particle i = team.particle(k); d = x[k] − x_j
/// by the nearest image, r2 = |d|². A call may come on any thread of the team, and also for pairs farther than
/// H: kernel functions are 0 there, and branches cost more than zeros.
/// range.weight(j, positions[j]) is m, or ρ0 V_j of a wall particle, in the density kernel;
/// range.pressure_term(j, positions[j]) is p/ρ² of j, 0 of a wall particle, in the force kernel.
template <class Range, class Team>
concept NeighborRange = requires(const Range range, Team& team, const Float3 (&x)[Team::particles_per_thread],
                                 const float4* positions, int j, float4 other, VisitArchetype visit) {
  range.for_each(team, x, positions, visit);
  { range.weight(j, other) } -> std::same_as<float>;
  { range.pressure_term(j, other) } -> std::same_as<float>;
};

/// A search is made from SolverOptions and called in this order: load; then per advance or evaluation arrange and
/// begin; then per substep find_neighbors, the kernels on what with_neighbors gives them, and integrate.
template <class Search>
concept NeighborSearch =
    requires(Search search, const Search& constant, Stream& stream, const Constants& c, ParticleArrays& arrays,
             const WallStore& walls, const Box& region, const DeviceGeometry& geometry, Branch branch, int substeps,
             const DeviceStatus& status, const Begin& begin) {
      requires std::constructible_from<Search, const SolverOptions&>;
      // Whether positions carry |x|² in place of a wall particle's ρ0 V_b and the mass.
      { Search::stores_square } -> std::convertible_to<bool>;
      // Whether find_neighbors is a Stream::when, for which integrate requests the branch.
      { Search::rebuilds_on_demand } -> std::convertible_to<bool>;
      // Constants and walls of a scene; boundary volumes are found here.
      search.load(stream, c, arrays, walls, region);
      // Which arrays hold the state at a substep's start, and which at its end.
      constant.arrange(arrays);
      // Launches `begin`, and what the search needs beside it.
      search.begin(stream, arrays, begin);
      // Neighbors of the state at hand, if those that are known do not serve any longer.
      search.template find_neighbors<false>(stream, arrays, geometry, branch);
      // Moves the particles and the walls to the end of the substep.
      search.template integrate<false>(stream, arrays, geometry, branch);
      // After kernels have run without an integration: the state is where it was.
      search.restore_state(stream, arrays);
      // All of an advance in one launch; false: substep by substep.
      { search.template advance<false>(stream, arrays, geometry, substeps) } -> std::same_as<bool>;
      // Whether substeps can be captured in a graph.
      { constant.capturable() } -> std::same_as<bool>;
      // More room where an advance or an evaluation found too little; whether anything changed.
      { search.grow(status) } -> std::same_as<bool>;
      { constant.bytes() } -> std::same_as<std::size_t>;
    };

/// A search whose particles may be a rank's own and ghosts, so many of them within a box now, and others elsewhere after the next
/// migration.
/// Its `integrate` takes an exchange (NoExchange of kernels/exchange.cuh) and calls start(Integrate) before it moves
/// the particles, and finish(Integrate::after) after that.
template <class Search>
concept RankSearch = NeighborSearch<Search> && requires(Search search, Stream& stream, int n, const Box& where) {
  search.set_particles(stream, n, where);
};

}  // namespace
}  // namespace decant::gpu
