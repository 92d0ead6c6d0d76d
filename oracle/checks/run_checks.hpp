/// \file
/// The checks that run a backend: advanced, trajectory, mass, containment, determinism; and those that need
/// more than one of its answers: conservation, invariance. Used by `judge`.
#pragma once

#include "oracle/checks/checks.hpp"
#include "oracle/checks/comparison.hpp"
#include "oracle/checks/conform.hpp"

#include <functional>
#include <initializer_list>

namespace decant {

/// asking(checks, question): asks unless none of these checks is wanted. A question that throws is a row that fails of
/// each of them, and false.
using Asking = std::function<bool(std::initializer_list<const char*> checks, const std::function<void()>& question)>;

/// Makes these checks as far as wanted, each from a fresh load.
void check_runs(Backend& backend, const Fixture& fixture, const PreparedReference& oracle, const Asking& asking,
                RowBuilder& builder);

}  // namespace decant
