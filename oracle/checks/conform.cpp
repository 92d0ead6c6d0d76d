/// \file
/// What the oracle prepares, and what is asked of a backend.
#include "oracle/checks/conform.hpp"

#include "oracle/checks/advanced_check.hpp"
#include "oracle/checks/comparison.hpp"
#include "oracle/checks/field_checks.hpp"
#include "oracle/checks/neighborhood.hpp"
#include "oracle/checks/run_ahead.hpp"
#include "oracle/checks/run_checks.hpp"
#include "oracle/checks/status_check.hpp"
#include "oracle/solution/sum_bound.hpp"
#include "reference/error.hpp"
#include "reference/sampling.hpp"
#include "reference/solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <set>

namespace decant {
namespace {

constexpr std::uint32_t offers_of_evaluate =
    Offer::density | Offer::acceleration | Offer::parts | Offer::neighbors | Offer::boundary_volume;

void run_fields(Backend& backend, const PreparedReference& oracle, RowBuilder& builder) {
  const std::uint32_t offers = backend.offers() & oracle.offers;
  if (!(offers & offers_of_evaluate)) return builder.not_run("fields", not_offered);
  const Answered answered = answered_by(offers);
  const auto n = oracle.own.fields.density.size(), m = oracle.own.fields.boundary_volume.size();
  Fields got = Fields::unwritten(n, m);
  if (const Status status = backend.evaluate(got); !status.ok()) return builder.failed("evaluation", describe(status));
  check_stages(got, answered, oracle, builder);
  Fields staged = Fields::unwritten(n, m);
  if (offers & Offer::given)
    if (const Status status = backend.evaluate(staged, &oracle.inputs); !status.ok())
      return builder.failed("acceleration", describe(status));
  check_staged(staged, offers & Offer::given ? answered : Answered{}, oracle, builder);
  check_evaluation(got, answered, oracle, builder);
}

/// What lists that verify themselves count in the first substep: the pairs of the state that was loaded. A
/// particle with a pair too near to H may have one more or less, and rarely two.
void check_verified(const PairTotals& counted, const ReferenceSolution& own, RowBuilder& builder) {
  if (counted.pairs == 0 && counted.wall_pairs == 0) return;
  const auto row = [&](const char* field, std::int64_t got, const auto& neighbors, const std::vector<bool>& ambiguous) {
    const auto unsure = std::count(ambiguous.begin(), ambiguous.end(), true);
    compare(std::abs(static_cast<double>(got - neighbors.sum())), 2.0 * static_cast<double>(unsure),
            builder.row("substep", field, "1"));
  };
  row("verified_pairs", counted.pairs, own.fields.fluid_neighbor_count, own.fluid_ambiguous);
  row("verified_wall_pairs", counted.wall_pairs, own.fields.wall_neighbor_count, own.wall_ambiguous);
}

void run_substep(Backend& backend, const Fixture& fixture, const PreparedReference& oracle, RowBuilder& builder) {
  if (const Status status = backend.advance(1); !status.ok()) return builder.failed("substep", describe(status));
  ParticleState got;
  backend.read(got);
  const auto n = fixture.state.size();
  if (got.position.cols() != n || got.velocity.cols() != n)
    return builder.failed(
        "substep", fmt::format("{} positions and {} velocities, not {}", got.position.cols(), got.velocity.cols(), n));
  if (got.substep != fixture.state.substep + 1)
    return builder.failed("substep", fmt::format("is at substep {}, not {}", got.substep, fixture.state.substep + 1));
  check_substep(got, all_answered(), fixture, oracle, builder);
  if (oracle.offers & Offer::neighbors) check_verified(backend.neighbor_stats().verified, oracle.own, builder);
}

/// Recorded against recomputed, both in double: only the last bits may differ between compilers. Tolerances
/// are for a port of 2⁻²⁴ and an oracle of 2⁻⁵³; here both are of 2⁻⁵³.
void require_reproduced(const Fixture& fixture, const std::string& name, const Eigen::VectorXd& recorded,
                        const Eigen::VectorXd& today, const Eigen::VectorXd& tolerance) {
  for (Eigen::Index k = 0; k < today.size(); ++k) {
    const double bound = 2 * reference_roundoff / (unit_roundoff + reference_roundoff) * tolerance[k];
    if (std::abs(recorded[k] - today[k]) <= bound) continue;
    throw InputError(fixture.name, name + "[" + std::to_string(k) + "]", fmt::format("{:.17g}", recorded[k]),
                     fmt::format("this build's reference gives {:.17g} ± {:.2g}; record the "
                                 "fixture anew if that is intended",
                                 today[k], bound));
  }
}

void require_reproduced(const Fixture& fixture, const ReferenceSolution& today) {
  const bool recorded_at_all = fixture.fields || fixture.sample_id.size() > 0;
  if (!recorded_at_all) return;
  if (fixture.fields) {
    const Fields& recorded = *fixture.fields;
    const auto check = [&](const char* name, const auto& then, const auto& now, const auto& bound) {
      require_reproduced(fixture, name, flat(then), flat(now), flat(bound));
    };
    check("boundary_volume", recorded.boundary_volume, today.fields.boundary_volume, today.tolerance.boundary_volume);
    check("density", recorded.density, today.fields.density, today.tolerance.density);
    check("pressure", recorded.pressure, today.fields.pressure, today.tolerance.pressure);
    for (const auto& field : acceleration_fields)
      check(field.name, recorded.*field.member, today.fields.*field.member, today.tolerance.*field.member);
    for (const auto& fact : neighbor_facts)
      check("neighbors", recorded.*fact.member, today.fields.*fact.member, today.tolerance.*fact.member);
    return;
  }
  const auto sampled = [&](const Eigen::VectorXd& all) {
    return Eigen::VectorXd(all(fixture.sample_id.cast<Eigen::Index>()));
  };
  const auto sampled3 = [&](const Eigen::Matrix3Xd& all) {
    return Eigen::Matrix3Xd(all(Eigen::all, fixture.sample_id.cast<Eigen::Index>()));
  };
  require_reproduced(fixture, "sample density", fixture.sample_density, sampled(today.fields.density),
                     sampled(today.tolerance.density));
  require_reproduced(fixture, "sample pressure", fixture.sample_pressure, sampled(today.fields.pressure),
                     sampled(today.tolerance.pressure));
  require_reproduced(fixture, "sample acceleration", flat(fixture.sample_acceleration),
                     flat(sampled3(today.fields.acceleration)), flat(sampled3(today.tolerance.acceleration)));
}

}  // namespace

std::string evaluate_oracle(const Scene& scene, const ParticleState& state, Fields& fields, ConditionSums& condition) {
  ReferenceSolution a = reference_solution(scene, sample_walls(scene), state);
  std::string why = ill_posed_reason(a);
  fields = std::move(a.fields);
  condition = std::move(a.condition);
  return why;
}

std::string ill_posed_reason(const ReferenceSolution& a) {
  const auto objection = [](const std::vector<bool>& ambiguous, std::int64_t most, const char* kind) {
    const auto count = std::count(ambiguous.begin(), ambiguous.end(), true);
    return count <= most ? std::string()
                         : fmt::format(
                               "{} particles have {} neighbors too near H for fp32 to place, "
                               "at most {} expected; ",
                               count, kind, most);
  };
  const std::string why = objection(a.fluid_ambiguous, a.most_fluid_ambiguous, "fluid") +
                          objection(a.wall_ambiguous, a.most_wall_ambiguous, "wall");
  return why.empty() ? why : why + "no backend can pass (a lattice? let it move first)";
}

StageInputs stage_inputs(const Scene& scene, const Fields& own, Staged staged) {
  const auto& fluid = scene.fluid;
  const double offset =
      staged == Staged::offset ? 0x1p-14 * fluid.rest_density * fluid.sound_speed * fluid.sound_speed : 0;
  StageInputs inputs;
  inputs.density = own.density.cast<float>().cast<double>();
  inputs.pressure = (own.pressure.array() + offset).cast<float>().cast<double>();
  return inputs;
}

PreparedReference prepare_reference(const Fixture& fixture, const CheckSelection& checks, int sample_every,
                                    Staged staged) {
  const Scene& scene = fixture.scene;
  PreparedReference prepared;
  prepared.walls = sample_walls(scene);
  prepared.volumes = wall_solution(scene, prepared.walls);
  const WallSolution& volumes = prepared.volumes;
  ReferenceAt reference(scene, prepared.walls, volumes, fixture.state);
  prepared.own = reference.solution();
  require_reproduced(fixture, prepared.own);
  prepared.inputs = stage_inputs(scene, prepared.own.fields, staged);
  const auto wanted = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(), [&](const char* name) { return checks.count(name) > 0; });
  };
  if (wanted({"fields", "conservation"})) {
    prepared.given = reference.solution(&prepared.inputs);
    prepared.given_fp32 = reference.fp32_fields(&prepared.inputs);
  }
  if (wanted({"fields"})) prepared.own_fp32 = reference.fp32_fields();
  if (wanted({"substep"})) prepared.substep = substep_solution(scene, fixture.state, prepared.own);
  if (wanted({"contact"})) prepared.contact = contact_problems(scene, fixture.state, prepared.own.fields.acceleration);
  const bool runs = wanted({"trajectory", "mass", "containment", "determinism"});
  if (runs || wanted({"advanced"})) prepared.segments = segments_of(fixture, sample_every);
  if (runs) {
    Solver solver(scene, prepared.walls, fixture.state, volumes.volume);
    run_ahead(fixture, prepared, [&](int substeps) {
      for (int k = 0; k < substeps; ++k) solver.substep();
      return solver.state();
    });
  }
  // Nobody looks beyond the last view.
  while (!runs && !prepared.segments.empty() && !prepared.segments.back().viewed) prepared.segments.pop_back();
  if (!wanted({"advanced"}))
    for (Segment& segment : prepared.segments) segment.viewed = false;
  if (wanted({"invariance"}))
    for (TransformedProblem& problem : transformed_problems(scene, fixture.state)) {
      const bool same_scene = problem.name == "permuted";
      Walls walls = same_scene ? prepared.walls : sample_walls(problem.scene);
      ReferenceSolution its_solution = reference_solution(
          problem.scene, walls, same_scene ? volumes : wall_solution(problem.scene, walls), problem.state);
      prepared.transformed.push_back({std::move(problem), std::move(walls), std::move(its_solution)});
    }
  return prepared;
}

namespace {

/// Checks that a backend may leave by throwing: a call that does not answer takes its time limit each time.
constexpr int most_ended = 2;

/// Every check that was selected and whose means the backend offers; not_run for the others. One that a backend leaves
/// by throwing fails, and the next ones start from a fresh load.
void run_offered(Backend& backend, const Fixture& fixture, const PreparedReference& oracle,
                 const CheckSelection& selected, RowBuilder& builder) {
  const std::uint32_t sums = Offer::density | Offer::acceleration;
  const struct {
    const char* check;
    std::uint32_t of_backend, of_reference;
  } needs[] = {
      {"substep", Offer::step, Offer::step},
      {"contact", Offer::step, 0},
      {"advanced", Offer::step | sums | Offer::parts | Offer::neighbors, 0},
      {"trajectory", Offer::step, Offer::step},
      {"mass", Offer::step, Offer::step},
      {"containment", Offer::step, Offer::step},
      {"determinism", Offer::step | sums | Offer::boundary_volume, Offer::step},
      {"conservation", Offer::given | Offer::parts, Offer::given | Offer::parts},
      {"invariance", sums, sums},
      {"status", Offer::step | Offer::status | sums, 0},
  };
  CheckSelection checks = selected;
  for (const auto& [check, of_backend, of_reference] : needs) {
    const bool offered =
        (backend.offers() & of_backend) == of_backend && (oracle.offers & of_reference) == of_reference;
    if (!offered && checks.erase(check) > 0) builder.not_run(check, not_offered);
  }

  std::string trouble;
  int ended = 0;
  bool loaded = false;
  const Asking asking = [&](std::initializer_list<const char*> names, const std::function<void()>& question) {
    if (std::ranges::none_of(names, [&](const char* name) { return checks.count(name) > 0; })) return false;
    std::string why = "not asked any more: " + trouble;
    if (ended < most_ended) {
      try {
        if (!loaded) backend.load(fixture.scene, oracle.walls, fixture.state);
        loaded = true;
        question();
        return true;
      } catch (const std::exception& error) {
        why = error.what();
        loaded = false;
        if (ended++ == 0) builder.failed("run", trouble = why);
      }
    }
    for (const char* name : names)
      if (checks.count(name)) builder.failed(name == std::string("fields") ? "evaluation" : name, why);
    return false;
  };
  asking({"fields"}, [&] { run_fields(backend, oracle, builder); });
  asking({"substep"}, [&] { run_substep(backend, fixture, oracle, builder); });
  asking({"contact"}, [&] { check_contact(backend, oracle.walls, oracle.contact, builder); });
  check_runs(backend, fixture, oracle, asking, builder);
  asking({"status"}, [&] { check_status(backend, fixture.scene, fixture.state.substep, builder); });
}

}  // namespace

std::vector<CheckRow> run_checks(Backend& backend, const Fixture& fixture, const PreparedReference& oracle,
                                 const CheckSelection& checks) {
  std::optional<RowBuilder> builder;
  try {
    builder.emplace(backend.info(), fixture.name);
    if (oracle.walls.size() == 0 || (backend.offers() & Offer::walls))
      run_offered(backend, fixture, oracle, checks, *builder);
    else builder->not_run("run", not_offered);
  } catch (const std::exception& error) {
    if (!builder) builder.emplace(BackendInfo{}, fixture.name);  // it cannot even say what it is
    builder->failed("run", error.what());
  }
  std::vector<CheckRow> rows = builder->take();
  for (CheckRow& row : rows)
    if (row.verdict == Verdict::not_run && row.reason == not_given) row.reason = not_offered;
  locate(fixture, oracle.walls, rows);
  return rows;
}

}  // namespace decant
