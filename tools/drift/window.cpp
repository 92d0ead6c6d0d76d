/// \file
/// The window is run once; every list is looked at along it. Lists of the same build and skin serve all
/// intervals that rebuild there.
#include "reference/error.hpp"
#include "reference/larger.hpp"
#include "reference/sampling.hpp"
#include "tools/common/clock.hpp"
#include "tools/drift/drift.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>

namespace decant::drift {
namespace {

std::vector<ParticleState> run_window(const Fixture& fixture, const Walls& walls, Backend& backend, int substeps) {
  std::vector<ParticleState> states(static_cast<std::size_t>(substeps) + 1);
  backend.load(fixture.scene, walls, fixture.state);
  states[0] = fixture.state;
  for (std::size_t k = 1; k < states.size(); ++k) {
    require_ok(backend, backend.advance(1));
    backend.read(states[k]);
  }
  return states;
}

/// A list as it ages.
struct Build {
  double skin;
  int built, last;  // substeps of the window
  std::vector<Staleness> ages;
};

std::vector<Build> builds_of(const Plan& plan) {
  std::map<std::pair<double, int>, int> last;  // skin and build; descending age is dearest first
  for (const ListChoice& list : plan.lists)
    for (int built = 0; built < plan.window; built += list.interval) {
      int& end = last[{list.skin, built}];
      end = std::max(end, std::min(built + list.interval, plan.window) - 1);
    }
  std::vector<Build> builds;
  for (const auto& [key, end] : last) builds.push_back({key.first, key.second, end, {}});
  std::stable_sort(builds.begin(), builds.end(),
                   [](const Build& a, const Build& b) { return a.last - a.built > b.last - b.built; });
  return builds;
}

double share(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

void raise(double& largest, double value) { largest = larger(largest, value); }

/// RMS over neighbors within H at the build of how far they moved against each other, over H.
double relative_motion(const Scene& scene, const Instant& built, const Instant& now) {
  const Separation apart(scene.domain);
  double squares = 0, pairs = 0;
  for (std::size_t i = 0; i < built.near.fluid.size(); ++i)
    for (const auto j : built.near.fluid[i]) {
      const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(j);
      squares += (apart(Vec3(now.state.position.col(a)), Vec3(now.state.position.col(b))) -
                  apart(Vec3(built.state.position.col(a)), Vec3(built.state.position.col(b))))
                     .squaredNorm();
      pairs += 1;
    }
  return pairs > 0 ? std::sqrt(squares / pairs) / scene.support_radius() : 0;
}

void fit_powers(const Scene& scene, const std::vector<Instant>& window, Result& result) {
  int longest = 0;
  for (const auto& s : result.samples)
    if (s.list.skin == 0) longest = std::max(longest, s.list.interval);
  std::array<std::vector<std::pair<double, double>>, 3> points;
  for (const auto& s : result.samples) {
    if (s.list.skin != 0 || s.list.interval != longest || s.stale.age == 0) continue;
    const auto k = static_cast<std::size_t>(s.substep);
    const double moved = relative_motion(scene, window[k - static_cast<std::size_t>(s.stale.age)], window[k]);
    points[0].emplace_back(moved, static_cast<double>(s.stale.fluid.missed));
    points[1].emplace_back(moved, s.stale.density.mean);
    points[2].emplace_back(moved, s.stale.acceleration.mean);
  }
  for (std::size_t k = 0; k < points.size(); ++k) result.powers[k] = fit_power(points[k]);
  result.edge_powers = edge_powers(scene);
}

/// Earliest age at which a list of that skin misses or may miss a pair; the window where none does. Skins
/// that theory chose for one interval were not looked at for longer.
std::vector<SafeInterval> safe_intervals(const Scene& scene, const PairsNearEdge& near, const Plan& plan,
                                         const std::vector<Build>& builds, const std::string& fixture) {
  std::map<double, SafeInterval> by_skin;
  for (const Build& build : builds) {
    if (std::none_of(plan.lists.begin(), plan.lists.end(),
                     [&](const ListChoice& list) { return !list.derived && list.skin == build.skin; }))
      continue;
    auto& safe = by_skin.try_emplace(build.skin, SafeInterval{fixture, build.skin, plan.window, plan.window, 0, 0})
                     .first->second;
    for (const Staleness& s : build.ages) {
      const int age = static_cast<int>(s.age);
      if (s.fluid.missed + s.wall.missed > 0) safe.measured = std::min(safe.measured, age);
      if (!s.provably_complete(build.skin, scene.support_radius())) safe.proved = std::min(safe.proved, age);
    }
  }
  std::vector<SafeInterval> all;
  for (auto& [skin, safe] : by_skin) {
    safe.expected = expected_safe_interval(scene, near, skin, false, plan.window);
    safe.expected_relative = expected_safe_interval(scene, near, skin, true, plan.window);
    all.push_back(safe);
  }
  return all;
}

}  // namespace

Row summed_up(const std::string& fixture, const std::vector<Sample>& samples) {
  Row row;
  row.fixture = fixture;
  row.list = samples.front().list;
  row.first_miss = row.list.interval;
  if (row.list.interval < 1)
    for (const Sample& sample : samples)
      row.first_miss = std::max(row.first_miss, static_cast<int>(sample.stale.age) + 1);
  row.proved_until = row.first_miss;
  const auto n = static_cast<double>(samples.size());
  for (const Sample& sample : samples) {
    const Staleness& s = sample.stale;
    const std::int64_t missed = s.fluid.missed + s.wall.missed, within = s.fluid.within + s.wall.within,
                       listed = s.fluid.listed + s.wall.listed;
    row.missed_share += share(missed, within) / n;
    raise(row.worst_missed_share, share(missed, within));
    row.wall_missed_share += share(s.wall.missed, s.wall.within) / n;
    row.wasted_share += share(listed - (within - missed), listed) / n;
    raise(row.deepest, std::max(s.fluid.deepest, s.wall.deepest));
    raise(row.density_score, s.density.score);
    raise(row.acceleration_score, s.acceleration.score);
    raise(row.density_rms, s.density.relative_rms);
    raise(row.pressure_rms, s.pressure.relative_rms);
    raise(row.acceleration_rms, s.acceleration.relative_rms);
    raise(row.wall_acceleration_rms, s.wall_acceleration.relative_rms);
    const int age = static_cast<int>(s.age);
    if (missed > 0) row.first_miss = std::min(row.first_miss, age);
    if (!sample.proved) row.proved_until = std::min(row.proved_until, age);
  }
  return row;
}

std::string ListChoice::options() const {
  return interval <= 0 ? "" : fmt::format("rebuild={}:skin={}", interval, skin);
}

std::vector<ListChoice> all_lists(const std::vector<int>& intervals, const std::vector<double>& skins) {
  std::vector<ListChoice> lists;
  for (const double skin : skins)
    for (const int interval : intervals) lists.push_back({interval, skin, false});
  return lists;
}

void require_ok(const Backend& backend, const Status& status) {
  if (!status.ok()) throw BackendError(backend.info().name + ": " + describe(status));
}

std::vector<ListChoice> derived_lists(const std::vector<Fixture>& fixtures, const std::vector<int>& intervals,
                                      double tolerance) {
  std::vector<ListChoice> lists;
  for (const int interval : intervals) lists.push_back({interval, 0, true});
  for (const Fixture& fixture : fixtures) {
    const Walls walls = sample_walls(fixture.scene);
    const WallSolution volumes = wall_solution(fixture.scene, walls);
    const PairsNearEdge near =
        pairs_near_edge(fixture.scene, volumes.volume, instant_of(fixture.scene, walls, volumes, fixture.state));
    for (ListChoice& list : lists) {
      const double age = (list.interval - 1) * fixture.scene.time_step();
      const double skin = skin_for(fixture.scene, near, age, tolerance);
      list.skin = std::max(list.skin, std::ceil(100 * skin - 1e-9) / 100);
    }
  }
  return lists;
}

Result measure(const Fixture& fixture, const Plan& plan, const ListMaker& make_list,
               const std::function<void(double)>& progress) {
  const auto start = Clock::now();
  const Scene& scene = fixture.scene;
  const Walls walls = sample_walls(scene);
  const WallSolution volumes = wall_solution(scene, walls);
  Result result;
  result.fixture = fixture.name;
  result.particle_spacing = scene.particle_spacing;
  result.support_radius = scene.support_radius();
  result.particles = fixture.state.size();

  const auto states =
      run_window(fixture, walls, *make_list(plan.chooses ? complete_list : own_list, false), plan.window);
  std::vector<Build> builds = builds_of(plan);
  std::mutex mutex;
  const std::size_t all = states.size() + builds.size();
  std::size_t done = 0;
  const auto one_done = [&] {
    const std::lock_guard lock(mutex);
    ++done;
    if (progress) progress(static_cast<double>(done) / static_cast<double>(all));
  };
  std::vector<Instant> window(states.size());
  tbb::parallel_for(std::size_t{0}, states.size(), [&](std::size_t k) {
    window[k] = instant_of(scene, walls, volumes, states[k]);
    one_done();
  });
  tbb::parallel_for(std::size_t{0}, builds.size(), [&](std::size_t k) {
    Build& build = builds[k];
    const StaleList list(scene, volumes.volume, window[static_cast<std::size_t>(build.built)], build.skin);
    for (int now = build.built; now <= build.last; ++now)
      build.ages.push_back(list.at(window[static_cast<std::size_t>(now)]));
    one_done();
  });

  const PairsNearEdge near = pairs_near_edge(scene, volumes.volume, window.front());
  for (const ListChoice& list : plan.lists) {
    std::vector<Sample> samples;
    for (int k = 0; k < plan.window; ++k) {
      const int built = k - k % list.interval;
      const auto build = std::find_if(builds.begin(), builds.end(),
                                      [&](const Build& b) { return b.skin == list.skin && b.built == built; });
      const Staleness& stale = build->ages[static_cast<std::size_t>(k - built)];
      samples.push_back({list, k, stale, stale.provably_complete(list.skin, scene.support_radius())});
    }
    result.rows.push_back(summed_up(fixture.name, samples));
    result.rows.back().expected = expected_drift(scene, near, (list.interval - 1) * scene.time_step(), list.skin);
    result.samples.insert(result.samples.end(), samples.begin(), samples.end());
  }
  result.safe = safe_intervals(scene, near, plan, builds, fixture.name);
  fit_powers(scene, window, result);
  if (!plan.chooses) measure_as_it_is(fixture, plan.window, plan.timed, *make_list(own_list, false), result);
  else if (plan.timed) time_and_follow(fixture, walls, plan.window, make_list, result);
  result.measured_seconds = seconds_since(start);
  return result;
}

}  // namespace decant::drift
