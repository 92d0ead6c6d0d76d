/// \file
/// Backends that keep their lists their own way, and lists that a backend gives.
#include "oracle/solution/reference_backend.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "tools/drift/drift.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace decant::drift {
namespace {

/// What is seen of a backend before each substep of a window.
struct Seen {
  std::vector<ParticleState> states;
  std::vector<std::size_t> built;  // index of the state
  std::vector<Neighbors> lists;    // of it, or
  std::vector<Fields> fields;      // where there are no lists
};

/// Where among the states a list was built. Throws BackendError where it is none of them.
std::size_t build_of(const Backend& backend, const std::vector<ParticleState>& states, std::int64_t built) {
  const auto then =
      std::find_if(states.begin(), states.end(), [&](const ParticleState& s) { return s.substep == built; });
  if (then == states.end())
    throw BackendError(fmt::format("{}: lists at substep {} were built at substep {}, which is not from {} to {}",
                                   backend.info().name, states.back().substep, built, states.front().substep,
                                   states.back().substep));
  return static_cast<std::size_t>(then - states.begin());
}

/// \param look  called with the states up to each substep's start
template <class Look>
void walk(const Fixture& fixture, const Walls& walls, Backend& backend, int window, std::vector<ParticleState>& states,
          Look look) {
  backend.load(fixture.scene, walls, fixture.state);
  states = {fixture.state};
  for (int k = 0;; ++k) {
    look();
    if (k + 1 == window) return;
    require_ok(backend, backend.advance(1));
    states.emplace_back();
    backend.read(states.back());
  }
}

Seen see(const Fixture& fixture, const Walls& walls, Backend& backend, int window) {
  Seen seen;
  walk(fixture, walls, backend, window, seen.states, [&] {
    if (backend.offers() & Offer::lists) {
      Neighbors lists;
      seen.built.push_back(build_of(backend, seen.states, backend.lists(lists)));
      seen.lists.push_back(std::move(lists));
    } else {
      Fields fields = Fields::unwritten(fixture.state.size(), walls.size());
      require_ok(backend, backend.evaluate(fields));
      seen.fields.push_back(std::move(fields));
    }
  });
  return seen;
}

}  // namespace

std::array<double, 2> missed_of_given_lists(const Fixture& fixture, const Walls& walls, Backend& backend, int window) {
  const Separation separation(fixture.scene.domain);
  const double H = fixture.scene.support_radius();
  PairCount fluid, wall;
  std::vector<ParticleState> states;
  std::vector<std::vector<std::int32_t>> kept;
  walk(fixture, walls, backend, window, states, [&] {
    Neighbors listed, near;
    (void)build_of(backend, states, backend.lists(listed));
    const ParticleState& now = states.back();
    const PosedWalls posed = pose_walls(fixture.scene, walls, fixture.scene.time_at(now.substep));
    find_neighbors(fixture.scene, now.position, posed.position, NeighborSearch::cells, near);
    compare_lists(separation, H, now.position, now.position, listed.fluid, near.fluid, kept, fluid);
    compare_lists(separation, H, now.position, posed.position, listed.wall, near.wall, kept, wall);
  });
  const auto share = [](std::int64_t missed, std::int64_t within) {
    return within > 0 ? static_cast<double>(missed) / static_cast<double>(within) : 0;
  };
  return {share(fluid.missed + wall.missed, fluid.within + wall.within), share(wall.missed, wall.within)};
}

void measure_as_it_is(const Fixture& fixture, int window, bool timed, Backend& backend, Result& result) {
  const Scene& scene = fixture.scene;
  const Walls walls = sample_walls(scene);
  const WallSolution volumes = wall_solution(scene, walls);
  const Seen seen = see(fixture, walls, backend, window);
  std::vector<Instant> instants(seen.states.size());
  tbb::parallel_for(std::size_t{0}, instants.size(),
                    [&](std::size_t k) { instants[k] = instant_of(scene, walls, volumes, seen.states[k]); });
  std::vector<Sample> samples(instants.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t k) {
    samples[k] = {own_list, static_cast<std::int64_t>(k), {}, false};
    if (seen.lists.empty()) compare_fields(scene, instants[k], seen.fields[k], samples[k].stale);
    else samples[k].stale = StaleList(scene, volumes.volume, instants[seen.built[k]], seen.lists[k]).at(instants[k]);
  });
  Row row = summed_up(fixture.name, samples);
  row.expected = {not_measured, not_measured, not_measured};
  if (seen.lists.empty()) {
    row.missed_share = row.worst_missed_share = row.wall_missed_share = row.wasted_share = row.deepest = not_measured;
    row.first_miss = row.proved_until = own_list.interval;
  } else {
    row.own_missed_share = row.missed_share;
    row.own_wall_missed_share = row.wall_missed_share;
    result.samples.insert(result.samples.end(), samples.begin(), samples.end());
  }
  if (timed) time_beside(fixture, walls, window, backend, *make_reference_backend(NeighborSearch::cells), row);
  result.rows.push_back(row);
}

}  // namespace decant::drift
