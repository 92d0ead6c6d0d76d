/// \file
/// The check `advanced`: fields of what a backend has in use in the middle of a run, which it carried along:
/// lists, orders, places of walls.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/checks/comparison.hpp"
#include "oracle/solution/fixture.hpp"
#include "oracle/solution/tolerance.hpp"

#include <vector>

namespace decant {

/// What a backend gives at one moment of a run: its state and, evaluated without a load, its fields.
struct View {
  std::int64_t substeps = 0;  // since the fixture's state
  ParticleState state;
  Fields fields;
  Status status;  // of the evaluation
};

/// Substeps after which a run is viewed: on small fixtures often, at odd and growing distances, so that
/// some views are just after a list was made and some just before it is made anew, which a backend may do
/// whenever it is interrupted: the longest segment is half of a run. None after `substeps`.
std::vector<int> viewed_after(Eigen::Index particles, std::int64_t substeps);

/// Reads the state, then evaluates.
View view(Backend& backend, Eigen::Index particles, Eigen::Index walls, std::int64_t substeps);

/// Rows of neighbor facts, density, pressure and accelerations for each view, "density after 7": the fields
/// are held to the oracle's answer at the state that was read.
void check_advanced(const std::vector<View>& views, const Fixture& fixture, const Walls& walls,
                    const WallSolution& volumes, RowBuilder& builder);

}  // namespace decant
