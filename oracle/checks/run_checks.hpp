/// \file
/// The checks that run a backend: advanced, trajectory, mass, containment, determinism; and those that need
/// more than one of its answers: conservation, invariance. Used by `judge`.
#pragma once

#include "oracle/checks/checks.hpp"
#include "oracle/checks/comparison.hpp"
#include "oracle/checks/conform.hpp"

namespace decant {

/// Makes the chosen ones of these checks, each from a fresh load.
void check_runs(Backend& backend, const Fixture& fixture, const PreparedReference& oracle, const CheckSelection& checks,
                RowBuilder& builder);

}  // namespace decant
