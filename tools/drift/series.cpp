/// \file
/// Lists of another program, checked as any input, then looked at like our own.
#include "oracle/files/foreign_file.hpp"
#include "oracle/lists/given_lists.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "tools/drift/drift.hpp"

#include <fmt/format.h>

#include <chrono>
#include <map>

namespace decant::drift {
namespace {

/// One kind of neighbors, ascending.
std::vector<std::vector<std::int32_t>> read_lists(const Hdf5Reader& in, const std::string& path, std::int64_t particles,
                                                  std::int64_t targets, bool of_fluid) {
  const RefuseList refuse = [&](const char* part, const std::string& value, const std::string& bound) {
    in.fail(path + part, value, bound);
  };
  const IdVector count = in.integers(path + "_count", particles);
  const IdVector entries = in.integers(path, checked_entries(count, targets, refuse));
  return checked_lists(count, entries, targets, of_fluid, refuse);
}

}  // namespace

Result measure_series(const Fixture& fixture, const std::filesystem::path& series) {
  const auto start = std::chrono::steady_clock::now();
  const Hdf5Reader in = open_foreign(series);
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
