/// \file
/// Views of a run, and the oracle's answer at each.
#include "oracle/checks/advanced_check.hpp"

#include "oracle/checks/field_checks.hpp"

#include <fmt/format.h>

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

std::vector<int> viewed_after(Eigen::Index particles, std::int64_t substeps) {
  std::vector<int> all{1, 4, 11, 28};
  if (particles > 2000) all = {9, 25};
  if (particles > 20000) all = {16};
  std::erase_if(all, [&](int after) { return after > substeps; });
  return all;
}

View view(Backend& backend, Eigen::Index particles, Eigen::Index walls, std::int64_t substeps) {
  View v;
  v.substeps = substeps;
  backend.read(v.state);
  v.fields = Fields::unwritten(particles, walls);
  v.status = backend.evaluate(v.fields);
  return v;
}

void check_advanced(const std::vector<View>& views, const Fixture& fixture, const Walls& walls,
                    const WallSolution& volumes, RowBuilder& builder) {
  for (const View& v : views) {
    if (const std::string why = objection(v.state, fixture, fixture.state.substep + v.substeps); !why.empty())
      return builder.failed("advanced", why);
    if (!v.status.ok()) return builder.failed("advanced", describe(v.status));
    check_fields("advanced", fmt::format(" after {}", v.substeps), v.fields,
                 reference_solution(fixture.scene, walls, volumes, v.state), builder);
  }
}

}  // namespace decant
