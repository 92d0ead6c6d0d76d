/// \file
/// A solver of somebody else as the reference, whose formulas nobody has analysed: how far correct values in fp32 may
/// be off is measured instead of derived.
///
/// The reference, in double, is evaluated on copies of the state whose positions, velocities and wall particles, fp32
/// numbers all, are each moved by at most half an ulp, and whose particles are permuted. How far a value moves at most
/// is its spread: the condition of everything that it depends on.
///
///   tau = 64 spread + 64 u (|value| + RMS),   u = 2⁻²⁴, RMS of the field
///
/// 64, because a port also rounds inside its formulas, and the second term for values whose inputs are exact; of
/// 159,000 values of two correct ports none is off by more (fixtures/results/host/spread.txt). What it does not see: an
/// error that the reference shares, and one below 64 spreads.
#pragma once

#include "oracle/checks/conform.hpp"

#include <string>

namespace decant {

inline constexpr double measured_factor = 64;  // of spread, and of roundings
inline constexpr int measured_copies = 16;

/// The checks that need no bound but measured ones: fields, substep, mass, containment, determinism, conservation,
/// invariance, status.
const CheckSelection& measured_checks();

/// What `reference` says about a fixture. Throws BackendError where it breaks down, reports trouble or leaves a value
/// that it offers unwritten or not finite.
/// \param reference  in double; loaded many times \param checks  of measured_checks()
/// \param sample_every  as of prepare_reference
PreparedReference measured_reference(Backend& reference, const Fixture& fixture, const CheckSelection& checks,
                                     int sample_every = 0);

}  // namespace decant
