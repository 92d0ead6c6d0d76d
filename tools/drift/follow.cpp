/// \file
/// Lists at work: what a substep costs with them, where the fluid is after a window, and what becomes of a
/// whole pour. Complete lists of the same backend on the same device are what they are held to.
#include "oracle/checks/audit.hpp"
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "tools/common/clock.hpp"
#include "tools/drift/drift.hpp"
#include "tools/pour/pour.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace decant::drift {
namespace {

Vec3 momentum(const Scene& scene, const ParticleState& state) {
  return scene.particle_mass() * state.velocity.rowwise().sum();
}

/// Of what a backend counted; one that counts nothing tells nothing.
double share(std::int64_t part, std::int64_t whole, const PairTotals& counted) {
  if (counted.pairs + counted.wall_pairs == 0) return not_measured;
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

/// From the fixture's state, with lists that are long enough: an advance that has to make them longer runs
/// all its substeps again.
void load_grown(const Fixture& fixture, const Walls& walls, Backend& list) {
  list.load(fixture.scene, walls, fixture.state);
  Fields fields;
  require_ok(list, list.evaluate(fields));
}

/// The backend's own account of a window. Not while it is timed: counting costs more than a substep.
void count_missed(const Fixture& fixture, const Walls& walls, Backend& list, int window, Row& row) {
  if (list.offers() & Offer::lists) {
    const auto missed = missed_of_given_lists(fixture, walls, list, window);
    row.own_missed_share = missed[0];
    row.own_wall_missed_share = missed[1];
    return;
  }
  load_grown(fixture, walls, list);
  require_ok(list, list.advance(window));
  const PairTotals counted = list.neighbor_stats().verified;
  row.own_missed_share = share(counted.missed + counted.wall_missed, counted.pairs + counted.wall_pairs, counted);
  row.own_wall_missed_share = share(counted.wall_missed, counted.wall_pairs, counted);
}

/// Where the fluid is after the ensemble's substeps.
ParticleState follow(const Fixture& fixture, const Walls& walls, Backend& list, int window) {
  const auto substeps = fixture.ensemble.members > 0 ? static_cast<int>(fixture.ensemble.substeps) : window;
  load_grown(fixture, walls, list);
  require_ok(list, list.advance(substeps));  // records, too
  ParticleState end;
  list.read(end);
  return end;
}

/// The same, and the time of a substep in the window after.
ParticleState follow_and_time(const Fixture& fixture, const Walls& walls, Backend& list, int window, Row& row) {
  const ParticleState end = follow(fixture, walls, list, window);
  require_ok(list, list.advance(1));  // the second advance is timed by stages
  // A short run is timed more than once.
  double best = INFINITY, spent = 0;
  for (int k = 0; k == 0 || (k < 3 && spent < 0.05); ++k) {
    const auto rebuilds = list.neighbor_stats().rebuilds;
    const auto start = Clock::now();
    require_ok(list, list.advance(window));
    const double seconds = seconds_since(start);
    best = std::min(best, seconds);
    spent += seconds;
    row.rebuild_every = static_cast<double>(window) /
                        static_cast<double>(std::max<std::int64_t>(1, list.neighbor_stats().rebuilds - rebuilds));
  }
  row.substep_us = 1e6 * best / window;
  return end;
}

/// One pour, looked at every so many substeps.
struct Course {
  std::vector<double> energy;  // J
  std::vector<Vec3> momentum;  // kg m/s
  WholePour pour;
};

void put_apart(const Fixture& fixture, const ParticleState& end, const ParticleState& right, Row& row) {
  const Scene& scene = fixture.scene;
  const Divergence away = divergence(scene, end, right);
  row.deviation = away[0] / scene.particle_spacing;
  row.energy_drift = away[4];
  row.momentum_drift = (momentum(scene, end) - momentum(scene, right)).norm();
  if (fixture.ensemble.members > 0) row.deviation_over_ensemble = away[0] / fixture.ensemble.mean[0];
}

constexpr int samples_at_whole = 100;

Course run_course(const Scene& scene, const Walls& walls, const ParticleState& start, Backend& backend) {
  Course course;
  Audit audit(scene);
  backend.load(scene, walls, start);
  ParticleState state = start;
  const std::int64_t all = std::int64_t{scene.schedule.frames} * scene.schedule.substeps_per_frame;
  for (int sample = 0;; ++sample) {
    const AuditResult seen = audit.sample(state);
    course.energy.push_back(seen.kinetic_energy + seen.potential_energy);
    course.momentum.push_back(momentum(scene, state));
    course.pour.inside = std::max(course.pour.inside, seen.inside);
    if (!(course.pour.kinetic_peak >= seen.kinetic_energy)) course.pour.kinetic_peak = seen.kinetic_energy;
    if (sample == samples_at_whole) {
      for (std::size_t p = 0; p < seen.particles_at.size(); ++p)
        course.pour.share_at[p] = static_cast<double>(seen.particles_at[p]) / static_cast<double>(state.size());
      break;
    }
    const Status status = backend.advance(static_cast<int>(all * (sample + 1) / samples_at_whole - state.substep));
    if (!status.ok()) {
      course.pour = {};
      course.pour.trouble = describe(status);
      return course;
    }
    backend.read(state);
  }
  course.pour.energy_lost = course.energy.front() - course.energy.back();
  const NeighborStats stats = backend.neighbor_stats();
  const PairTotals& counted = stats.verified;
  course.pour.missed_share = share(counted.missed + counted.wall_missed, counted.pairs + counted.wall_pairs, counted);
  course.pour.wall_missed_share = share(counted.wall_missed, counted.wall_pairs, counted);
  course.pour.rebuild_every = static_cast<double>(all) / static_cast<double>(std::max<std::int64_t>(1, stats.rebuilds));
  return course;
}

/// RMS differences from complete lists, over what there is to differ.
void compare(const Course& right, Course& course) {
  if (!course.pour.trouble.empty()) return;
  double energy = 0, momentum = 0, whole = 0;
  for (std::size_t k = 0; k < right.energy.size(); ++k) {
    energy += std::pow(course.energy[k] - right.energy[k], 2);
    momentum += (course.momentum[k] - right.momentum[k]).squaredNorm();
    whole += right.momentum[k].squaredNorm();
  }
  const auto n = static_cast<double>(right.energy.size());
  course.pour.energy_drift = std::sqrt(energy / n) / std::abs(right.pour.energy_lost);
  course.pour.momentum_drift = std::sqrt(momentum / whole);
}

}  // namespace

void time_and_follow(const Fixture& fixture, const Walls& walls, int window, const ListMaker& make_list,
                     Result& result) {
  const auto start = Clock::now();
  Row adaptive;
  adaptive.fixture = fixture.name;
  adaptive.list = complete_list;
  adaptive.first_miss = adaptive.proved_until = 0;
  const ParticleState right = follow_and_time(fixture, walls, *make_list(complete_list, false), window, adaptive);
  adaptive.deviation = adaptive.deviation_over_ensemble = 0;
  adaptive.energy_drift = adaptive.momentum_drift = 0;
  count_missed(fixture, walls, *make_list(complete_list, true), window, adaptive);
  for (Row& row : result.rows) {
    const auto list = make_list(row.list, false);
    put_apart(fixture, follow_and_time(fixture, walls, *list, window, row), right, row);
    count_missed(fixture, walls, *make_list(row.list, true), window, row);
  }
  result.rows.push_back(adaptive);
  result.run_seconds = seconds_since(start);
}

void time_beside(const Fixture& fixture, const Walls& walls, int window, Backend& backend, Backend& right, Row& row) {
  const ParticleState end = follow_and_time(fixture, walls, backend, window, row);
  put_apart(fixture, end, follow(fixture, walls, right, window), row);
}

void whole_pours(const Scene& scene, const Plan& plan, int perturbed, const ListMaker& make_list, const DoPart& do_part,
                 std::vector<WholePour>& pours) {
  const Walls walls = sample_walls(scene);
  const ParticleState start = initial_state(scene);
  const auto run = [&](const ParticleState& from, const ListChoice& list) {
    Course course;
    do_part([&] { course = run_course(scene, walls, from, *make_list(list, true)); });
    return course;
  };
  const auto add = [&](Course course, const ListChoice& list, std::uint32_t perturbation) {
    course.pour.fixture = scene.name;
    course.pour.list = list;
    course.pour.perturbation = perturbation;
    pours.push_back(course.pour);
  };
  Course right = run(start, complete_list);
  if (!right.pour.trouble.empty()) throw BackendError(scene.name + ", complete lists: " + right.pour.trouble);
  compare(right, right);
  add(right, complete_list, 0);
  for (int k = 1; k <= perturbed; ++k) {
    Course course = run(pour::perturbed_start(start, static_cast<std::uint32_t>(k)), complete_list);
    compare(right, course);
    add(std::move(course), complete_list, static_cast<std::uint32_t>(k));
  }
  for (const ListChoice& list : plan.lists) {
    Course course = run(start, list);
    compare(right, course);
    add(std::move(course), list, 0);
  }
}

}  // namespace decant::drift
