/// \file
/// The check `advanced`: fields of what a backend has in use after a run, which it carried along: lists,
/// orders, places of walls.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/comparison.hpp"
#include "oracle/fixture.hpp"
#include "oracle/tolerance.hpp"

#include <vector>

namespace decant {

/// Substeps from one look to the next: on small fixtures many, of odd and growing lengths, so that some end
/// just after a list was made and some just before it is made anew. No more than `substeps` together.
std::vector<int> advanced_stretches(Eigen::Index particles, std::int64_t substeps);

/// Rows of neighbor facts, density, pressure and accelerations after each stretch, "density after 7", the
/// number counted from the fixture's state: the state is read, and the backend's fields, evaluated without a
/// load, are held to the oracle's answer at the state that was read. No longer than the fixture's ensemble.
void judge_advanced(Backend& backend, const Fixture& fixture, const Walls& walls,
                    const WallAnswer& volumes, Sheet& sheet);

}  // namespace decant
