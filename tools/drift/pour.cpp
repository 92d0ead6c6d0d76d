/// \file
/// Along a scene: one run by complete lists, and at moments of it what other lists would miss.
#include "reference/error.hpp"
#include "reference/initial_state.hpp"
#include "reference/sampling.hpp"
#include "tools/drift/drift.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace decant::drift {

PourResult along_pour(const Scene& scene, const Plan& plan, int samples, const ListMaker& make_list,
                      std::vector<Fixture>& phases) {
  const Walls walls = sample_walls(scene);
  const WallSolution volumes = wall_solution(scene, walls);
  const std::int64_t all = std::int64_t{scene.schedule.frames} * scene.schedule.substeps_per_frame;
  std::set<int> ages = {0};
  for (const ListChoice& list : plan.lists) ages.insert(list.interval - 1);

  const auto complete = make_list(complete_list, false);
  ParticleState state = initial_state(scene);
  complete->load(scene, walls, state);
  const auto go_to = [&](std::int64_t substep) {
    if (substep <= state.substep) return;
    require_ok(*complete, complete->advance(static_cast<int>(substep - state.substep)));
    complete->read(state);
  };
  // Phases lie between the moments; each is passed on the way to the next moment.
  std::vector<Fixture*> waiting;
  for (Fixture& phase : phases) waiting.push_back(&phase);
  std::stable_sort(waiting.begin(), waiting.end(),
                   [](const Fixture* a, const Fixture* b) { return a->state.substep < b->state.substep; });
  auto next = waiting.begin();
  const auto pass_phases = [&](std::int64_t until) {
    for (; next != waiting.end() && (*next)->state.substep <= until; ++next) {
      go_to((*next)->state.substep);
      (*next)->state = state;
    }
  };

  PourResult pour;
  pour.fixture = scene.name;
  for (int sample = 0; sample < samples; ++sample) {
    const std::int64_t built = all * sample / samples;
    pass_phases(built);
    go_to(built);
    std::vector<ParticleState> states;
    for (const int age : ages) {
      pass_phases(built + age);
      go_to(built + age);
      states.push_back(state);
    }
    std::vector<Instant> instants(states.size());
    tbb::parallel_for(std::size_t{0}, states.size(), [&](std::size_t k) {
      const auto at = k;
      instants[at] = instant_of(scene, walls, volumes, states[at]);
    });
    std::vector<PourMoment> moments(plan.lists.size());
    tbb::parallel_for(std::size_t{0}, plan.lists.size(), [&](std::size_t k) {
      const ListChoice& list = plan.lists[k];
      const auto at = static_cast<std::size_t>(std::distance(ages.begin(), ages.find(list.interval - 1)));
      const Staleness stale = StaleList(scene, volumes.volume, instants.front(), list.skin).at(instants[at]);
      moments[k] = {
          scene.time_at(built),
          {list, built + list.interval - 1, stale, stale.provably_complete(list.skin, scene.support_radius())}};
    });
    pour.moments.insert(pour.moments.end(), moments.begin(), moments.end());
  }
  pass_phases(all);
  return pour;
}

}  // namespace decant::drift
