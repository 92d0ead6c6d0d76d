/// \file
/// What the oracle prepares, and the checks of fields and of one substep.
#include "oracle/conform.hpp"

#include "oracle/comparison.hpp"
#include "oracle/run_checks.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "reference/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>

namespace decant {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct AccelerationField {
  const char* name;
  Eigen::Matrix3Xd Fields::*member;
};
constexpr AccelerationField accelerations[] = {
    {"pressure_acceleration", &Fields::pressure_acceleration},
    {"viscous_acceleration", &Fields::viscous_acceleration},
    {"wall_pressure_acceleration", &Fields::wall_pressure_acceleration},
    {"wall_viscous_acceleration", &Fields::wall_viscous_acceleration},
    {"acceleration", &Fields::acceleration},
};

void judge_accelerations(const char* check, const Fields& got, const OracleAnswer& oracle,
                         const Fields& in_float, Sheet& sheet) {
  for (const auto& field : accelerations)
    compare({flat(got.*field.member), flat(oracle.fields.*field.member),
             flat(oracle.tolerance.*field.member), flat(in_float.*field.member), 3, nullptr, 0},
            sheet.row(check, field.name, "m/s^2"));
}

void judge_neighbors(const Fields& got, const OracleAnswer& oracle, Sheet& sheet) {
  struct Fact {
    const char* name;
    IdVector Fields::*member;
    const std::vector<bool>* ambiguous;
    std::int64_t most;
  };
  const Fact facts[] = {
      {"fluid_neighbor_count", &Fields::fluid_neighbor_count, &oracle.fluid_ambiguous,
       oracle.most_fluid_ambiguous},
      {"fluid_neighbor_id_sum", &Fields::fluid_neighbor_id_sum, &oracle.fluid_ambiguous,
       oracle.most_fluid_ambiguous},
      {"wall_neighbor_count", &Fields::wall_neighbor_count, &oracle.wall_ambiguous,
       oracle.most_wall_ambiguous},
      {"wall_neighbor_id_sum", &Fields::wall_neighbor_id_sum, &oracle.wall_ambiguous,
       oracle.most_wall_ambiguous},
  };
  for (const Fact& fact : facts) {
    const Eigen::VectorXd expected = flat(oracle.fields.*fact.member);
    compare({flat(got.*fact.member), expected, Eigen::VectorXd::Zero(expected.size()), {}, 1,
             fact.ambiguous, fact.most, 0.0},
            sheet.row("neighbors", fact.name, "1"));
  }
}

void judge_fields(Backend& backend, const Judgement& oracle, Sheet& sheet) {
  const auto n = oracle.own.fields.density.size(), m = oracle.own.fields.boundary_volume.size();
  Fields got = Fields::unwritten(n, m);
  if (const Status status = backend.evaluate(got); !status.ok())
    return sheet.failed("evaluation", describe(status));
  const auto scalar = [&](const char* name, Eigen::VectorXd Fields::*member, const char* unit) {
    compare({got.*member, oracle.own.fields.*member, oracle.own.tolerance.*member,
             oracle.own_float.*member, 1, nullptr, 0},
            sheet.row(name, name, unit));
  };
  judge_neighbors(got, oracle.own, sheet);
  scalar("boundary_volume", &Fields::boundary_volume, "m^3");
  scalar("density", &Fields::density, "kg/m^3");
  scalar("pressure", &Fields::pressure, "Pa");

  Fields staged = Fields::unwritten(n, m);
  if (const Status status = backend.evaluate(staged, &oracle.inputs); !status.ok())
    return sheet.failed("acceleration", describe(status));
  judge_accelerations("acceleration", staged, oracle.given, oracle.given_float, sheet);
  judge_accelerations("evaluation", got, oracle.own, oracle.own_float, sheet);
}

/// The outcome that position and velocity together are nearest to, by score.
const SubstepOutcome& nearest_outcome(const std::vector<SubstepOutcome>& outcomes,
                                      const ParticleState& got, Eigen::Index i) {
  const SubstepOutcome* nearest = &outcomes.front();
  double least = infinity;
  for (const SubstepOutcome& outcome : outcomes) {
    double worst = 0;
    for (int c = 0; c < 3 && i < got.size(); ++c) {
      worst = std::max(worst, score_of(std::abs(got.position(c, i) - outcome.position[c]),
                                       outcome.position_tolerance[c]));
      worst = std::max(worst, score_of(std::abs(got.velocity(c, i) - outcome.velocity[c]),
                                       outcome.velocity_tolerance[c]));
    }
    if (worst < least) {
      least = worst;
      nearest = &outcome;
    }
  }
  return *nearest;
}

void judge_substep(Backend& backend, const Fixture& fixture, const Judgement& oracle,
                   Sheet& sheet) {
  if (const Status status = backend.advance(1); !status.ok())
    return sheet.failed("substep", describe(status));
  ParticleState got;
  backend.read(got);
  const SubstepAnswer& answer = oracle.substep;
  const auto n = static_cast<Eigen::Index>(answer.outcomes.size());
  if (got.position.cols() != n || got.velocity.cols() != n)
    return sheet.failed("substep", fmt::format("{} positions and {} velocities, not {}",
                                               got.position.cols(), got.velocity.cols(), n));
  if (got.substep != fixture.state.substep + 1)
    return sheet.failed("substep", fmt::format("is at substep {}, not {}", got.substep,
                                               fixture.state.substep + 1));
  Eigen::Matrix3Xd x(3, n), v(3, n), tau_x(3, n), tau_v(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const SubstepOutcome& nearest = nearest_outcome(answer.outcomes[static_cast<std::size_t>(i)],
                                                    got, i);
    x.col(i) = nearest.position;
    v.col(i) = nearest.velocity;
    tau_x.col(i) = nearest.position_tolerance;
    tau_v.col(i) = nearest.velocity_tolerance;
  }
  // An undecidable push is no longer than a particle spacing and no faster than sound.
  compare({flat(got.position), flat(x), flat(tau_x), {}, 3, &answer.ambiguous,
           answer.most_ambiguous, -infinity, fixture.scene.particle_spacing},
          sheet.row("substep", "position", "m"));
  compare({flat(got.velocity), flat(v), flat(tau_v), {}, 3, &answer.ambiguous,
           answer.most_ambiguous, -infinity, fixture.scene.fluid.sound_speed},
          sheet.row("substep", "velocity", "m/s"));
}

/// Recorded against recomputed, both in double: only the last bits may differ between compilers.
void require_reproduced(const Fixture& fixture, const std::string& name,
                        const Eigen::VectorXd& recorded, const Eigen::VectorXd& today,
                        const Eigen::VectorXd& tolerance) {
  for (Eigen::Index k = 0; k < today.size(); ++k) {
    const double bound = 0x1p-29 * tolerance[k];
    if (std::abs(recorded[k] - today[k]) <= bound) continue;
    throw InputError(fixture.name, name + "[" + std::to_string(k) + "]",
                     fmt::format("{:.17g}", recorded[k]),
                     fmt::format("this build's reference gives {:.17g} ± {:.2g}; record the "
                                 "fixture anew if that is intended",
                                 today[k], bound));
  }
}

void require_reproduced(const Fixture& fixture, const OracleAnswer& today) {
  if (fixture.fields) {
    const Fields& recorded = *fixture.fields;
    const auto check = [&](const char* name, const auto& then, const auto& now, const auto& bound) {
      require_reproduced(fixture, name, flat(then), flat(now), flat(bound));
    };
    check("boundary_volume", recorded.boundary_volume, today.fields.boundary_volume,
          today.tolerance.boundary_volume);
    check("density", recorded.density, today.fields.density, today.tolerance.density);
    check("pressure", recorded.pressure, today.fields.pressure, today.tolerance.pressure);
    for (const auto& field : accelerations)
      check(field.name, recorded.*field.member, today.fields.*field.member,
            today.tolerance.*field.member);
    for (auto member : {&Fields::fluid_neighbor_count, &Fields::fluid_neighbor_id_sum,
                        &Fields::wall_neighbor_count, &Fields::wall_neighbor_id_sum})
      check("neighbors", recorded.*member, today.fields.*member, today.tolerance.*member);
    return;
  }
  const auto sampled = [&](const Eigen::VectorXd& all) {
    return Eigen::VectorXd(all(fixture.sample_id.cast<Eigen::Index>()));
  };
  const auto sampled3 = [&](const Eigen::Matrix3Xd& all) {
    return Eigen::Matrix3Xd(all(Eigen::all, fixture.sample_id.cast<Eigen::Index>()));
  };
  require_reproduced(fixture, "sample density", fixture.sample_density,
                     sampled(today.fields.density), sampled(today.tolerance.density));
  require_reproduced(fixture, "sample pressure", fixture.sample_pressure,
                     sampled(today.fields.pressure), sampled(today.tolerance.pressure));
  require_reproduced(fixture, "sample acceleration", flat(fixture.sample_acceleration),
                     flat(sampled3(today.fields.acceleration)),
                     flat(sampled3(today.tolerance.acceleration)));
}

}  // namespace

std::string evaluate_oracle(const Scene& scene, const ParticleState& state, Fields& fields,
                            ConditionSums& condition) {
  OracleAnswer a = answer(scene, sample_walls(scene), state);
  const auto objection = [](const std::vector<bool>& ambiguous, std::int64_t most,
                            const char* kind) {
    const auto count = std::count(ambiguous.begin(), ambiguous.end(), true);
    return count <= most ? std::string()
                         : fmt::format("{} particles have {} neighbors too near H for fp32 to place, "
                                       "at most {} expected; ",
                                       count, kind, most);
  };
  const std::string why = objection(a.fluid_ambiguous, a.most_fluid_ambiguous, "fluid") +
                          objection(a.wall_ambiguous, a.most_wall_ambiguous, "wall");
  fields = std::move(a.fields);
  condition = std::move(a.condition);
  return why.empty() ? why : why + "no backend can pass (a lattice? let it move first)";
}

namespace {

/// The oracle's own run with the looks that a backend's run gets.
void run_ahead(const Fixture& fixture, Judgement& j) {
  for (auto left = static_cast<int>(fixture.ensemble.substeps); left > 0; left -= j.stretches.back())
    j.stretches.push_back((left + 1) / 2);
  Solver solver(fixture.scene, j.walls, fixture.state);
  Audit audit(fixture.scene);
  audit.look(fixture.state);
  for (const int stretch : j.stretches) {
    for (int k = 0; k < stretch; ++k) solver.substep();
    j.later_look = audit.look(solver.state());
    j.deepest = std::max(j.deepest, j.later_look.deepest);
    j.crossed = std::max(j.crossed, j.later_look.crossed);
  }
  j.later = solver.state();
}

}  // namespace

Judgement prepare(const Fixture& fixture, const CheckSelection& checks) {
  const Scene& scene = fixture.scene;
  Judgement j;
  j.walls = sample_walls(scene);
  j.own = answer(scene, j.walls, fixture.state);
  require_reproduced(fixture, j.own);
  j.inputs.density = j.own.fields.density.cast<float>().cast<double>();
  j.inputs.pressure = j.own.fields.pressure.cast<float>().cast<double>();
  const auto wanted = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return checks.count(name) > 0; });
  };
  if (wanted({"fields", "conservation"})) {
    j.given = answer(scene, j.walls, fixture.state, &j.inputs);
    j.given_float = float_fields(scene, j.walls, fixture.state, &j.inputs);
  }
  if (wanted({"fields"})) j.own_float = float_fields(scene, j.walls, fixture.state);
  if (wanted({"substep"})) j.substep = substep_answer(scene, fixture.state, j.own);
  if (wanted({"trajectory", "mass", "containment", "determinism"})) run_ahead(fixture, j);
  if (wanted({"invariance"}))
    for (TransformedProblem& problem : transformed_problems(scene, fixture.state)) {
      Walls walls = sample_walls(problem.scene);
      OracleAnswer its_answer = answer(problem.scene, walls, problem.state);
      j.transformed.push_back({std::move(problem), std::move(walls), std::move(its_answer)});
    }
  return j;
}

std::vector<CheckRow> judge(Backend& backend, const Fixture& fixture, const Judgement& oracle,
                            const CheckSelection& checks) {
  std::optional<Sheet> sheet;
  try {
    sheet.emplace(backend.info(), fixture);
    backend.load(fixture.scene, oracle.walls, fixture.state);
    if (checks.count("fields")) judge_fields(backend, oracle, *sheet);
    if (checks.count("substep")) judge_substep(backend, fixture, oracle, *sheet);
    judge_runs(backend, fixture, oracle, checks, *sheet);
  } catch (const std::exception& error) {
    if (!sheet) sheet.emplace(BackendInfo{}, fixture);  // it cannot even say what it is
    sheet->failed("run", error.what());
  }
  return sheet->take();
}

}  // namespace decant
