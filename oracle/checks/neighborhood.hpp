/// \file
/// Where a check failed: the particle of a row's worst value, who is near it, and what is around
/// it, to look at or to judge again.
#pragma once

#include "oracle/report/report.hpp"
#include "oracle/solution/fixture.hpp"

#include <vector>

namespace decant {

/// True where `locate` found the row's worst particle.
bool is_located(const CheckRow& row);

/// True where the row's ids are those of wall particles.
bool is_of_walls(const CheckRow& row);

/// Fills position and neighbors of the worst particle in every row that fails at one, as the
/// fixture's state has them.
void locate(const Fixture& fixture, const Walls& walls, std::vector<CheckRow>& rows);

/// Fluid and walls within `radius` (m) of a located row's worst particle. \param density  N, kg/m³,
/// the oracle's; \param index  the row's place in the report
Neighborhood neighborhood_of(const Fixture& fixture, const Walls& walls, const Eigen::VectorXd& density,
                             const CheckRow& row, std::int64_t index, double radius);

/// A fixture of part of the fluid, in the same scene at the same time.
struct Reproducer {
  Fixture fixture;             // without fields, condition sums and ensemble
  IdVector id;                 // whose id each particle had, ascending
  std::int64_t particle = -1;  // the worst one's id in the cut, −1 for a wall particle
};

/// The fluid within `radius` (m) of a located row's worst particle. Sums over neighbors keep their
/// order, so that with 2 H the worst particle's density, pressure and acceleration keep their bits.
Reproducer reproducer_of(const Fixture& fixture, const CheckRow& row, double radius);

}  // namespace decant
