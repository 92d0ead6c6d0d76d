/// \file
/// Fields and one substep against the oracle's, each value by its own tolerance.
#include "oracle/checks/field_checks.hpp"

#include <algorithm>
#include <cmath>

namespace decant {
namespace {

/// Compares where the field was answered, else leaves a row that did not run.
void check_field(const char* check, const char* name, const char* unit, const Answered& answered, const Values& values,
                 RowBuilder& builder) {
  CheckRow& row = builder.row(check, name, unit);
  if (answered.count(name)) compare(values, row);
  else row.reason = not_given;
}

void check_accelerations(const char* check, const Fields& got, const Answered& answered,
                         const ReferenceSolution& oracle, const Fields& in_float, RowBuilder& builder) {
  for (const auto& field : acceleration_fields)
    check_field(check, field.name, "m/s^2", answered,
                {flat(got.*field.member), flat(oracle.fields.*field.member), flat(oracle.tolerance.*field.member),
                 flat(in_float.*field.member), 3, nullptr, 0},
                builder);
}

/// The outcome that position and velocity together are nearest to, by score.
const SubstepOutcome& nearest_outcome(const std::vector<SubstepOutcome>& outcomes, const ParticleState& got,
                                      Eigen::Index i) {
  const SubstepOutcome* nearest = &outcomes.front();
  double least = infinity;
  for (const SubstepOutcome& outcome : outcomes) {
    double worst = 0;
    const auto apart = [&](const Eigen::Matrix3Xd& values, const Vec3& expected, const Vec3& tolerance) {
      for (int c = 0; c < 3 && i < values.cols(); ++c)
        worst = std::max(worst, score_of(std::abs(values(c, i) - expected[c]), tolerance[c]));
    };
    apart(got.position, outcome.position, outcome.position_tolerance);
    apart(got.velocity, outcome.velocity, outcome.velocity_tolerance);
    if (worst < least) {
      least = worst;
      nearest = &outcome;
    }
  }
  return *nearest;
}

}  // namespace

NearestOutcomes nearest_outcomes(const std::vector<std::vector<SubstepOutcome>>& outcomes, const ParticleState& got) {
  const auto n = static_cast<Eigen::Index>(outcomes.size());
  NearestOutcomes all{Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const SubstepOutcome& nearest = nearest_outcome(outcomes[static_cast<std::size_t>(i)], got, i);
    all.position.col(i) = nearest.position;
    all.velocity.col(i) = nearest.velocity;
    all.position_tolerance.col(i) = nearest.position_tolerance;
    all.velocity_tolerance.col(i) = nearest.velocity_tolerance;
  }
  return all;
}

ParticleState nearest_images(ParticleState got, const Scene& scene,
                             const std::vector<std::vector<SubstepOutcome>>& outcomes) {
  if (got.position.cols() != static_cast<Eigen::Index>(outcomes.size())) return got;
  for (int a = 0; a < 3; ++a) {
    if (!scene.domain.periodic[static_cast<std::size_t>(a)]) continue;
    const double low = scene.domain.min[a], high = scene.domain.max[a], period = high - low,
                 slack = 4 * unit_roundoff * (period + std::abs(low));
    for (Eigen::Index i = 0; i < got.position.cols(); ++i) {
      double& x = got.position(a, i);
      if (!(x >= low - slack && x <= high + slack)) continue;
      const double expected = outcomes[static_cast<std::size_t>(i)].front().position[a];
      x -= period * std::round((x - expected) / period);
    }
  }
  return got;
}

Answered answered_by(std::uint32_t offers) {
  Answered names;
  const auto add = [&](std::uint32_t bit, std::initializer_list<const char*> fields) {
    if (offers & bit) names.insert(fields.begin(), fields.end());
  };
  add(Offer::boundary_volume, {"boundary_volume"});
  add(Offer::density, {"density", "pressure"});
  add(Offer::acceleration, {"acceleration"});
  if (offers & Offer::parts)
    for (const auto& field : acceleration_fields)
      if (field.member != &Fields::acceleration) names.insert(field.name);
  if (offers & Offer::neighbors)
    for (const auto& fact : neighbor_facts) names.insert(fact.name);
  add(Offer::step, {"position", "velocity"});
  return names;
}

const Answered& all_answered() {
  static const Answered all = answered_by(Offer::all);
  return all;
}

void check_stages(const Fields& got, const Answered& answered, const PreparedReference& oracle, RowBuilder& builder) {
  const ReferenceSolution& own = oracle.own;
  for (const NeighborFact& fact : neighbor_facts) {
    const Eigen::VectorXd expected = flat(own.fields.*fact.member);
    check_field("neighbors", fact.name, "1", answered,
                {flat(got.*fact.member),
                 expected,
                 Eigen::VectorXd::Zero(expected.size()),
                 {},
                 1,
                 fact.of_walls ? &own.wall_ambiguous : &own.fluid_ambiguous,
                 fact.of_walls ? own.most_wall_ambiguous : own.most_fluid_ambiguous,
                 0.0},
                builder);
  }
  for (const StageField& field : stage_fields)
    check_field(field.name, field.name, field.unit, answered,
                {got.*field.member, own.fields.*field.member, own.tolerance.*field.member,
                 oracle.own_fp32.*field.member, 1, nullptr, 0},
                builder);
}

void check_staged(const Fields& got, const Answered& answered, const PreparedReference& oracle, RowBuilder& builder) {
  check_field("equation_of_state", "pressure", "Pa", answered,
              {got.pressure, oracle.given.fields.pressure, oracle.given.tolerance.pressure, oracle.given_fp32.pressure,
               1, nullptr, 0},
              builder);
  check_accelerations("acceleration", got, answered, oracle.given, oracle.given_fp32, builder);
}

void check_evaluation(const Fields& got, const Answered& answered, const PreparedReference& oracle,
                      RowBuilder& builder) {
  check_accelerations("evaluation", got, answered, oracle.own, oracle.own_fp32, builder);
}

void check_substep(const ParticleState& state_of_backend, const Answered& answered, const Fixture& fixture,
                   const PreparedReference& oracle, RowBuilder& builder) {
  const SubstepSolution& solution = oracle.substep;
  const ParticleState got = nearest_images(state_of_backend, fixture.scene, solution.outcomes);
  const NearestOutcomes nearest = nearest_outcomes(solution.outcomes, got);
  // An undecidable push is no longer than a particle spacing, or than what pushes back from deep inside
  // a wall: one projection the one way, and two as long the other way; and no faster than sound.
  const double apart = std::max(fixture.scene.particle_spacing, 3 * solution.longest_push);
  check_field("substep", "position", "m", answered,
              {flat(got.position),
               flat(nearest.position),
               flat(nearest.position_tolerance),
               {},
               3,
               &solution.ambiguous,
               solution.most_ambiguous,
               -infinity,
               apart},
              builder);
  check_field("substep", "velocity", "m/s", answered,
              {flat(got.velocity),
               flat(nearest.velocity),
               flat(nearest.velocity_tolerance),
               {},
               3,
               &solution.ambiguous,
               solution.most_ambiguous,
               -infinity,
               fixture.scene.fluid.sound_speed},
              builder);
}

void check_fields(const char* check, const std::string& after, const Fields& got, const ReferenceSolution& oracle,
                  RowBuilder& builder) {
  const auto row = [&](const char* field, const char* unit) -> CheckRow& {
    return builder.row(check, field + after, unit);
  };
  for (const NeighborFact& fact : neighbor_facts) {
    const Eigen::VectorXd expected = flat(oracle.fields.*fact.member);
    compare({flat(got.*fact.member),
             expected,
             Eigen::VectorXd::Zero(expected.size()),
             {},
             1,
             fact.of_walls ? &oracle.wall_ambiguous : &oracle.fluid_ambiguous,
             fact.of_walls ? oracle.most_wall_ambiguous : oracle.most_fluid_ambiguous,
             0.0},
            row(fact.name, "1"));
  }
  for (const StageField& field : stage_fields)
    compare({got.*field.member, oracle.fields.*field.member, oracle.tolerance.*field.member, {}},
            row(field.name, field.unit));
  for (const AccelerationField& field : acceleration_fields)
    compare({flat(got.*field.member), flat(oracle.fields.*field.member), flat(oracle.tolerance.*field.member), {}, 3},
            row(field.name, "m/s^2"));
}

void check_momentum(const Fields& got, const Answered& answered, const Fixture& fixture,
                    const PreparedReference& oracle, RowBuilder& builder) {
  const double mass = fixture.scene.particle_mass();
  const auto momentum = [&](const char* name, const char* part, Eigen::Matrix3Xd Fields::* field) {
    CheckRow& row = builder.row("conservation", name, "N");
    if (!answered.count(part)) {
      row.reason = not_given;
      return;
    }
    Values v;
    v.actual = mass * (got.*field).rowwise().sum();
    v.expected = mass * (oracle.given.fields.*field).rowwise().sum();
    v.tolerance = mass * (oracle.given.tolerance.*field).rowwise().norm();
    if ((oracle.given_fp32.*field).cols() > 0) v.fp32_value = mass * (oracle.given_fp32.*field).rowwise().sum();
    v.components = 3;
    compare(v, row);
    row.worst_id = -1;
  };
  momentum("pressure_momentum", "pressure_acceleration", &Fields::pressure_acceleration);
  momentum("viscous_momentum", "viscous_acceleration", &Fields::viscous_acceleration);
}

}  // namespace decant
