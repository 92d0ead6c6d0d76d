/// \file
/// Runs of some tens of substeps, looked at on the way.
#include "oracle/checks/run_checks.hpp"

#include "oracle/checks/advanced_check.hpp"
#include "oracle/checks/audit.hpp"
#include "oracle/checks/field_checks.hpp"
#include "reference/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace decant {
namespace {

/// What a run left behind.
struct Run {
  Status status;
  ParticleState early, end;  // after the oracle's `repeated` segments, after all
  NeighborStats counted;     // then
  std::vector<AuditResult> samples;
  std::vector<View> views;
};

/// A run of the oracle's first `count` segments.
Run run(Backend& backend, const Fixture& fixture, const PreparedReference& oracle, std::size_t count) {
  const ParticleState& start = fixture.state;
  Run r;
  backend.load(fixture.scene, oracle.walls, start);
  Audit audit(fixture.scene);
  audit.sample(start);
  std::int64_t done = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Segment& segment = oracle.segments[k];
    r.status = backend.advance(segment.substeps);
    if (!r.status.ok()) return r;
    done += segment.substeps;
    backend.read(r.end);
    if (r.end.position.cols() != start.size() || r.end.velocity.cols() != start.size()) return r;
    if (k + 1 == oracle.repeated) {
      r.early = r.end;
      r.counted = backend.neighbor_stats();
    }
    r.samples.push_back(audit.sample(r.end));
    if (segment.viewed) r.views.push_back(view(backend, start.size(), oracle.walls.size(), done));
  }
  return r;
}

/// Bits that differ, value by value.
std::int64_t differing(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return std::max(a.size(), b.size());
  std::int64_t count = 0;
  for (Eigen::Index c = 0; c < a.cols(); ++c)
    for (Eigen::Index r = 0; r < a.rows(); ++r)
      count += std::bit_cast<std::uint64_t>(a(r, c)) != std::bit_cast<std::uint64_t>(b(r, c));
  return count;
}

void check_trajectory(const Run& r, const Fixture& fixture, const PreparedReference& oracle, RowBuilder& builder) {
  const Divergence apart = divergence(fixture.scene, r.end, oracle.later);
  const Divergence bound = divergence_bound(fixture.ensemble);
  for (std::size_t k = 0; k < apart.size(); ++k) {
    CheckRow& row = builder.row("trajectory", divergence_names[k], divergence_units[k]);
    compare(apart[k], bound[k], row);
    if (row.verdict == Verdict::fail)
      row.reason = fmt::format("{} substeps on; {} perturbed runs of the oracle are apart by {:.3g} ± {:.2g}",
                               fixture.ensemble.substeps, fixture.ensemble.members, fixture.ensemble.mean[k],
                               fixture.ensemble.deviation[k]);
  }
}

/// Particles that have both position and velocity of another one, bit for bit, though they should be
/// `apart` and did not start as one; two drops that come to rest in one corner may well be the same to
/// fp32, and what parts those that start as one is nothing but the order of a sum.
std::int64_t doubled(const ParticleState& s, const ParticleState& start, const ParticleState& expected, double apart,
                     std::int64_t& one) {
  std::vector<std::array<double, 6>> all(static_cast<std::size_t>(s.size()));
  std::vector<std::size_t> order(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    order[i] = i;
    for (int c = 0; c < 3; ++c) {
      all[i][static_cast<std::size_t>(c)] = s.position(c, static_cast<Eigen::Index>(i));
      all[i][static_cast<std::size_t>(c) + 3] = s.velocity(c, static_cast<Eigen::Index>(i));
    }
  }
  const auto before = [&](std::size_t a, std::size_t b) { return std::memcmp(&all[a], &all[b], sizeof all[a]) < 0; };
  std::sort(order.begin(), order.end(), before);
  std::int64_t count = 0;
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (before(order[k - 1], order[k])) continue;
    const auto i = static_cast<Eigen::Index>(order[k - 1]), j = static_cast<Eigen::Index>(order[k]);
    if ((expected.position.col(i) - expected.position.col(j)).norm() <= apart) continue;
    if (start.position.col(i) == start.position.col(j) && start.velocity.col(i) == start.velocity.col(j)) continue;
    one = static_cast<std::int64_t>(order[k]);
    ++count;
  }
  return count;
}

void check_mass(const Run& r, const Fixture& fixture, const PreparedReference& oracle, RowBuilder& builder) {
  const auto n = fixture.state.size();
  const auto exact = [&](const char* field, std::int64_t off, const std::string& why, std::int64_t id) {
    CheckRow& row = builder.row("mass", field, "1");
    compare(static_cast<double>(off), 0, row, id);
    row.n = n;
    if (off != 0) row.reason = fmt::format("{} {}", off, why);
  };
  std::int64_t bad = 0, bad_id = -1, one = -1;
  for (Eigen::Index i = n; i-- > 0;)
    if (!r.end.position.col(i).allFinite() || !r.end.velocity.col(i).allFinite()) {
      ++bad;
      bad_id = i;
    }
  exact("finite", bad, "particles are no numbers", bad_id);
  const std::int64_t twins = doubled(r.end, fixture.state, oracle.later, 0.01 * fixture.scene.particle_spacing, one);
  exact("distinct", twins, "particles are another one's copy", one);
  const AuditResult& last = r.samples.back();
  std::int64_t total = 0;
  for (const auto count : last.particles_at) total += count;
  exact("places", std::abs(total - n), "particles are in no place or in two", -1);
  const auto lost = static_cast<std::size_t>(Region::lost);
  exact("lost", std::max<std::int64_t>(0, last.particles_at[lost] - oracle.later_sample.particles_at[lost]),
        "particles more than the oracle's are outside the domain", -1);
}

/// A distance to a wall is rounded as in tolerance.hpp: 8 u X, X the largest magnitude it passes through.
/// Where the oracle's own run stays out of walls, pushes end at the contact distance, so that rounding shows
/// only as far as it exceeds that: not at all, unless contact is at the surface itself. A floor may hold
/// particles at any distance from a wall.
double depth_tolerance(const Scene& scene, double oracle_deepest) {
  double X = std::max(scene.domain.min.cwiseAbs().maxCoeff(), scene.domain.max.cwiseAbs().maxCoeff());
  for (const Container& c : scene.containers) X = std::max(X, c.origin.cwiseAbs().maxCoeff());
  const double rounding = 8 * unit_roundoff * X;
  return oracle_deepest == 0 && !scene.floor ? std::max(0.0, rounding - scene.contact_distance()) : rounding;
}

void check_containment(const Run& r, const Scene& scene, const PreparedReference& oracle, RowBuilder& builder) {
  double deepest = 0;
  std::int64_t deepest_id = -1, crossed = 0, crossed_id = -1, when = -1, substep = 0;
  for (std::size_t k = 0; k < r.samples.size(); ++k) {
    const AuditResult& sample = r.samples[k];
    substep += oracle.segments[k].substeps;
    if (sample.deepest > deepest) {
      deepest = sample.deepest;
      deepest_id = sample.deepest_particle;
    }
    if (sample.crossed > 0 && when < 0) {
      when = substep;
      crossed_id = sample.first_crossed;
    }
    crossed = std::max(crossed, sample.crossed);
  }
  CheckRow& depth = builder.row("containment", "depth", "m");
  compare(std::max(0.0, deepest - oracle.deepest), depth_tolerance(scene, oracle.deepest), depth, deepest_id);
  if (depth.verdict == Verdict::fail)
    depth.reason = fmt::format("{:.3g} m inside a wall, the oracle's run {:.3g} m", deepest, oracle.deepest);
  CheckRow& paths = builder.row("containment", "crossings", "1");
  compare(static_cast<double>(std::max<std::int64_t>(0, crossed - oracle.crossed)), 0, paths, crossed_id);
  if (paths.verdict == Verdict::fail)
    paths.reason = fmt::format("{} particles went through a wall, first seen {} substeps on", crossed, when);
}

void check_conservation(Backend& backend, const Fixture& fixture, const PreparedReference& oracle,
                        RowBuilder& builder) {
  backend.load(fixture.scene, oracle.walls, fixture.state);
  const auto n = oracle.given.fields.density.size(), m = oracle.own.fields.boundary_volume.size();
  Fields got = Fields::unwritten(n, m);
  if (const Status status = backend.evaluate(got, &oracle.inputs); !status.ok())
    return builder.failed("conservation", describe(status));
  if (got.pressure_acceleration.cols() != n || got.viscous_acceleration.cols() != n)
    return builder.failed("conservation", "accelerations of another number of particles");
  check_momentum(got, all_answered(), fixture, oracle, builder);
}

/// The same fluid without containers: whatever a backend keeps from one load to the next is to be found anew then. Nobody
/// has to take such a scene.
void load_without_containers(Backend& backend, const Fixture& fixture) {
  Scene scene = fixture.scene;
  scene.containers.clear();
  try {
    backend.load(scene, {}, fixture.state);
  } catch (const BackendError&) {
  }
}

void check_determinism(Backend& backend, const Fixture& fixture, const PreparedReference& oracle, const Run& first,
                       RowBuilder& builder) {
  const auto n = oracle.own.fields.density.size(), m = oracle.own.fields.boundary_volume.size();
  std::array<Fields, 2> fields{Fields::unwritten(n, m), Fields::unwritten(n, m)};
  for (Fields& f : fields) {
    load_without_containers(backend, fixture);
    backend.load(fixture.scene, oracle.walls, fixture.state);
    if (const Status status = backend.evaluate(f); !status.ok()) return builder.failed("determinism", describe(status));
  }
  const auto exact = [&](const char* name, std::int64_t differ) {
    CheckRow& row = builder.row("determinism", name, "1");
    compare(static_cast<double>(differ), 0, row);
    row.n = n;
    if (differ != 0) row.reason = fmt::format("{} values differ from the first time", differ);
  };
  const Fields &a = fields[0], &b = fields[1];
  exact("fields", differing(a.density, b.density) + differing(a.pressure, b.pressure) +
                      differing(a.acceleration, b.acceleration) + differing(a.boundary_volume, b.boundary_volume));
  const Run second = run(backend, fixture, oracle, oracle.repeated);
  if (!second.status.ok()) return builder.failed("determinism", describe(second.status));
  exact("run", differing(first.early.position, second.early.position) +
                   differing(first.early.velocity, second.early.velocity));
  const auto &once = first.counted, &twice = second.counted;
  exact("statistics", (once.rebuilds != twice.rebuilds) + (once.verified.pairs != twice.verified.pairs) +
                          (once.verified.missed != twice.verified.missed) +
                          (once.verified.wall_pairs != twice.verified.wall_pairs) +
                          (once.verified.wall_missed != twice.verified.wall_missed));
}

/// Columns by the ids that particles had; a matrix of another number of them stays as it is.
template <class Matrix>
Eigen::VectorXd by_original(const TransformedProblem& problem, const Matrix& m) {
  const auto n = static_cast<Eigen::Index>(problem.original.size());
  const Eigen::Index components = Matrix::RowsAtCompileTime == 3 ? 3 : 1;
  const Eigen::VectorXd in = flat(m);
  if (in.size() != n * components) return in;
  Eigen::VectorXd out(in.size());
  for (Eigen::Index i = 0; i < n; ++i)
    out.segment(components * problem.original[static_cast<std::size_t>(i)], components) =
        in.segment(components * i, components);
  return out;
}

void check_invariance(Backend& backend, const PreparedReference& oracle, RowBuilder& builder) {
  for (const TransformedSolution& t : oracle.transformed) {
    const auto n = t.solution.fields.density.size(), m = t.solution.fields.boundary_volume.size();
    backend.load(t.problem.scene, t.walls, t.problem.state);
    Fields got = Fields::unwritten(n, m);
    if (const Status status = backend.evaluate(got); !status.ok())
      return builder.failed("invariance", t.problem.name + ": " + describe(status));
    const auto row = [&](const char* field, const char* unit) -> CheckRow& {
      return builder.row("invariance", t.problem.name + " " + field, unit);
    };
    const auto same = [&](const char* field, const char* unit, auto member, int components) {
      compare({by_original(t.problem, got.*member),
               by_original(t.problem, t.solution.fields.*member),
               by_original(t.problem, t.solution.tolerance.*member),
               {},
               components},
              row(field, unit));
    };
    same("density", "kg/m^3", &Fields::density, 1);
    same("pressure", "Pa", &Fields::pressure, 1);
    same("acceleration", "m/s^2", &Fields::acceleration, 3);
  }
}

}  // namespace

void check_runs(Backend& backend, const Fixture& fixture, const PreparedReference& oracle, const Asking& asking,
                RowBuilder& builder) {
  Run r;
  const auto all = {"advanced", "trajectory", "mass", "containment", "determinism"};
  if (!oracle.segments.empty() && asking(all, [&] { r = run(backend, fixture, oracle, oracle.segments.size()); })) {
    const bool whole = r.end.position.cols() == fixture.state.size() && r.end.velocity.cols() == fixture.state.size();
    for (const char* name : all)
      asking({name}, [&] {
        if (!r.status.ok()) {
          builder.failed(name, describe(r.status));
        } else if (!whole) {
          builder.failed(name, fmt::format("{} positions and {} velocities, not {}", r.end.position.cols(),
                                           r.end.velocity.cols(), fixture.state.size()));
        } else if (name == std::string("advanced")) {
          check_advanced(r.views, fixture, oracle.walls, oracle.volumes, builder);
        } else if (name == std::string("trajectory")) {
          check_trajectory(r, fixture, oracle, builder);
        } else if (name == std::string("mass")) {
          check_mass(r, fixture, oracle, builder);
        } else if (name == std::string("containment")) {
          check_containment(r, fixture.scene, oracle, builder);
        } else {
          check_determinism(backend, fixture, oracle, r, builder);
        }
      });
  }
  asking({"conservation"}, [&] { check_conservation(backend, fixture, oracle, builder); });
  asking({"invariance"}, [&] { check_invariance(backend, oracle, builder); });
}

}  // namespace decant
