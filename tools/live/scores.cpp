/// \file
/// The tolerances are those of `decant conform`; here only the largest of each particle is kept.
#include "tools/live/scores.hpp"

#include "oracle/report/report.hpp"

namespace decant::live {

Scores scores_of(const Scene& scene, const Walls& walls, const WallSolution& volumes, const ParticleState& state,
                 const Fields& fields) {
  const ReferenceSolution oracle = reference_solution(scene, walls, volumes, state);
  Scores scores;
  scores.time = scene.time_at(state.substep);
  scores.values.setZero(state.size());
  const auto compare = [&](const char* name, const auto& actual, const auto& expected, const auto& tolerance) {
    for (Eigen::Index i = 0; i < state.size(); ++i) {
      for (Eigen::Index c = 0; c < actual.rows(); ++c) {
        const double score = score_of(std::abs(actual(c, i) - expected(c, i)), tolerance(c, i));
        if (score > scores.values[i]) scores.values[i] = score;
        if (score > scores.largest) {
          scores.largest = score;
          scores.particle = i;
          scores.field = name;
        }
      }
    }
  };
  const auto& f = oracle.fields;
  const auto& t = oracle.tolerance;
  compare("density", fields.density.transpose(), f.density.transpose(), t.density.transpose());
  compare("pressure", fields.pressure.transpose(), f.pressure.transpose(), t.pressure.transpose());
  compare("acceleration", fields.acceleration, f.acceleration, t.acceleration);
  return scores;
}

}  // namespace decant::live
