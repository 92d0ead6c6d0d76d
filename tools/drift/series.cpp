/// \file
/// Lists of another program, checked as any input, then looked at like our own.
#include "oracle/files/hdf5_io.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "tools/drift/drift.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>

namespace decant::drift {
namespace {

/// One kind of neighbors, ascending.
std::vector<std::vector<std::int32_t>> read_lists(const Hdf5Reader& in, const std::string& path, std::int64_t particles,
                                                  std::int64_t targets, bool own_ids) {
  const IdVector count = in.integers(path + "_count", particles);
  std::int64_t sum = 0;
  for (const std::int64_t c : count) {
    if (c < 0 || c > targets) in.fail(path + "_count", fmt::format("{}", c), fmt::format("0 to {}", targets));
    sum += c;
  }
  const IdVector entries = in.integers(path, sum);
  std::vector<std::vector<std::int32_t>> lists(static_cast<std::size_t>(particles));
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < lists.size(); ++i) {
    auto& list = lists[i];
    for (std::int64_t c = 0; c < count[static_cast<Eigen::Index>(i)]; ++c) {
      const std::int64_t j = entries[at++];
      if (j < 0 || j >= targets)
        in.fail(path, fmt::format("entry {} of particle {}", j, i), fmt::format("0 to {}", targets - 1));
      if (own_ids && j == static_cast<std::int64_t>(i))
        in.fail(path, fmt::format("particle {} in its own list", i), "others only");
      list.push_back(static_cast<std::int32_t>(j));
    }
    std::sort(list.begin(), list.end());
    if (const auto twice = std::adjacent_find(list.begin(), list.end()); twice != list.end())
      in.fail(path, fmt::format("entry {} of particle {} twice", *twice, i), "each neighbor once");
  }
  return lists;
}

/// A list that has each pair once, as many codes keep it, would read as one that misses half of them.
void require_both_directions(const Hdf5Reader& in, const std::string& path,
                             const std::vector<std::vector<std::int32_t>>& lists) {
  std::int64_t entries = 0;
  for (std::size_t i = 0; i < lists.size(); ++i)
    for (const std::int32_t j : lists[i]) {
      ++entries;
      const auto& back = lists[static_cast<std::size_t>(j)];
      if (std::binary_search(back.begin(), back.end(), static_cast<std::int32_t>(i))) return;
    }
  if (entries > 1)
    in.fail(path, fmt::format("{} pairs, none of them in both lists", entries),
            "every pair in the lists of both its particles; a half list has to be written out");
}

}  // namespace

Result measure_series(const Fixture& fixture, const std::filesystem::path& series) {
  const auto start = std::chrono::steady_clock::now();
  const Hdf5Reader in(series);
  if (!in.has_attribute("/", "decant_list_series"))
    in.fail("/@decant_list_series", "missing", "1: a series of states and lists");
  if (const auto schema = in.integer_attribute("/", "decant_list_series"); schema != 1)
    in.fail("/@decant_list_series", fmt::format("{}", schema), "1");
  const Scene& scene = fixture.scene;
  const Walls walls = sample_walls(scene);
  const WallSolution volumes = wall_solution(scene, walls);
  const auto n = fixture.state.size();
  const auto states = static_cast<std::int64_t>(in.children("/state").size());
  if (states == 0) in.fail("/state", "empty", "groups 0, 1, …, one a state");

  std::map<std::int64_t, Instant> instants;  // by substep
  std::vector<std::int64_t> substeps, used;
  for (std::int64_t k = 0; k < states; ++k) {
    const std::string group = fmt::format("/state/{}", k);
    ParticleState state;
    state.substep = in.integers(group + "/substep", 1)[0];
    if (k > 0 && state.substep <= substeps.back())
      in.fail(group + "/substep", fmt::format("{} after {}", state.substep, substeps.back()), "ascending");
    state.position = in.matrix3(group + "/position", n);
    state.velocity = in.matrix3(group + "/velocity", n);
    if (!state.position.allFinite() || !state.velocity.allFinite())
      in.fail(group, "not finite", "finite positions and velocities");
    substeps.push_back(state.substep);
    used.push_back(in.integers(group + "/list", 1)[0]);
    instants[state.substep] = instant_of(scene, walls, volumes, state);
  }
  std::map<std::int64_t, StaleList> lists;
  std::vector<Sample> samples;
  for (std::size_t k = 0; k < substeps.size(); ++k) {
    const std::string group = fmt::format("/list/{}", used[k]);
    auto list = lists.find(used[k]);
    if (list == lists.end()) {
      const std::int64_t built = in.integers(group + "/built", 1)[0];
      const auto then = instants.find(built);
      if (then == instants.end())
        in.fail(group + "/built", fmt::format("{}", built), "the substep of one of the states");
      Neighbors listed;
      listed.fluid = read_lists(in, group + "/fluid", n, n, true);
      require_both_directions(in, group + "/fluid", listed.fluid);
      listed.wall = read_lists(in, group + "/wall", n, walls.size(), false);
      list = lists.emplace(used[k], StaleList(scene, volumes.volume, then->second, std::move(listed))).first;
    }
    const Staleness stale = list->second.at(instants[substeps[k]]);
    if (stale.age < 0)
      in.fail(fmt::format("/state/{}/list", k), fmt::format("{}", used[k]), "a list built at or before the state");
    samples.push_back({{-1, not_measured, false}, substeps[k], stale, false});
  }
  Result result;
  result.fixture = fixture.name;
  result.particle_spacing = scene.particle_spacing;
  result.support_radius = scene.support_radius();
  result.particles = n;
  result.rows.push_back(summed_up(fixture.name, samples));
  // Theory asks when a list is rebuilt, which a series does not tell beforehand.
  result.rows.back().expected = {not_measured, not_measured, not_measured};
  result.samples = std::move(samples);
  result.edge_powers = edge_powers(scene);
  result.measured_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace decant::drift
