/// \file
/// The oracle's substep once more, carrying an error bound along with every particle.
#include "oracle/solution/substep_solution.hpp"

#include "oracle/solution/contact_bounds.hpp"

#include <algorithm>
#include <cmath>

namespace decant {

void gather_images(const Domain& domain, std::vector<SubstepOutcome>& outcomes) {
  for (int a = 0; a < 3; ++a) {
    if (!domain.periodic[static_cast<std::size_t>(a)]) continue;
    const double period = domain.max[a] - domain.min[a], first = outcomes.front().position[a];
    for (SubstepOutcome& outcome : outcomes)
      outcome.position[a] -= period * std::round((outcome.position[a] - first) / period);
  }
}

SubstepSolution substep_solution(const Scene& scene, const ParticleState& state, const ReferenceSolution& fields) {
  const ContactBounds bounds(scene);
  const std::vector<Pose> poses = bounds.poses_at(scene.time_at(state.substep + 1));
  const auto n = static_cast<std::size_t>(state.size());
  SubstepSolution solution;
  solution.outcomes.resize(n);
  solution.ambiguous.assign(n, false);
  solution.most_ambiguous = state.size() / 50 + 10;
  for (std::size_t k = 0; k < n; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const auto run = [&](unsigned flips) {
      BoundedParticle p{state.position.col(i), state.velocity.col(i), {}, {}};
      p.flips = flips;
      bounds.accelerate(fields.fields.acceleration.col(i), fields.tolerance.acceleration.col(i), p);
      bounds.fly(p);
      bounds.collide(poses, p);
      return p;
    };
    each_decision(run, [&](const BoundedParticle& p) {
      solution.outcomes[k].push_back({p.x, p.v, p.tau_x.components, p.tau_v.components});
      if (!p.ambiguous && p.undecided <= most_undecided) return;
      solution.ambiguous[k] = true;
      solution.longest_push = std::max(solution.longest_push, p.pushed);
    });
    gather_images(scene.domain, solution.outcomes[k]);
  }
  return solution;
}

}  // namespace decant
