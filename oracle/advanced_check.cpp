/// \file
/// Runs, looks, and the oracle's answer at each.
#include "oracle/advanced_check.hpp"

#include "oracle/field_checks.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace decant {
namespace {

/// Why the oracle cannot be asked there; empty where it can.
std::string objection(const ParticleState& s, const Fixture& fixture, std::int64_t substep) {
  const auto n = fixture.state.size();
  if (s.position.cols() != n || s.velocity.cols() != n)
    return fmt::format("{} positions and {} velocities, not {}", s.position.cols(), s.velocity.cols(), n);
  if (s.substep != substep) return fmt::format("is at substep {}, not {}", s.substep, substep);
  const Domain& domain = fixture.scene.domain;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!s.position.col(i).allFinite() || !s.velocity.col(i).allFinite())
      return fmt::format("particle {} is no number", i);
    for (int a = 0; a < 3; ++a)
      if (!domain.periodic[static_cast<std::size_t>(a)] &&
          !(s.position(a, i) >= domain.min[a] && s.position(a, i) <= domain.max[a]))
        return fmt::format("particle {} is outside the domain", i);
  }
  return {};
}

}  // namespace

std::vector<int> advanced_stretches(Eigen::Index particles, std::int64_t substeps) {
  std::vector<int> all{1, 3, 7, 17};
  if (particles > 2000) all = {2, 9};
  if (particles > 20000) all = {7};
  for (int& stretch : all) {
    stretch = static_cast<int>(std::min<std::int64_t>(stretch, substeps));
    substeps -= stretch;
  }
  std::erase(all, 0);
  return all;
}

void judge_advanced(Backend& backend, const Fixture& fixture, const Walls& walls,
                    const WallAnswer& volumes, Sheet& sheet) {
  backend.load(fixture.scene, walls, fixture.state);
  std::int64_t done = 0;
  for (const int stretch : advanced_stretches(fixture.state.size(), fixture.ensemble.substeps)) {
    if (const Status status = backend.advance(stretch); !status.ok())
      return sheet.failed("advanced", describe(status));
    done += stretch;
    ParticleState state;
    backend.read(state);
    if (const std::string why = objection(state, fixture, fixture.state.substep + done); !why.empty())
      return sheet.failed("advanced", why);
    Fields got = Fields::unwritten(state.size(), walls.size());
    if (const Status status = backend.evaluate(got); !status.ok())
      return sheet.failed("advanced", describe(status));
    judge_fields("advanced", fmt::format(" after {}", done), got,
                 answer(fixture.scene, walls, volumes, state), sheet);
  }
}

}  // namespace decant
