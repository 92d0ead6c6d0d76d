/// \file
/// A port of any solver against that solver's own double-precision reference: fields of any name,
/// on states of theirs. Tolerances come from the reference's file alone, so that a port cannot
/// widen its own. The files' layout is in formats/results.md.
///
///   tau = (√n + c) (u + u_ref) C + A + a + r · RMS
///
/// by value: C the condition sum Σ|t|(1 + κ) and n the number of its terms (tolerances.md), c and u of the
/// port, u_ref of the reference's own sums; A an absolute tolerance of each value, a and r one for all, absolute and
/// relative, RMS = √(Σx²/count) of the reference's whole field. What is not stated is 0; where none of C, A, a, r is
/// stated there is nothing to judge by, and the field is not_run. Integers need no tolerance: without one they are
/// exact.
#pragma once

#include "oracle/files/results.hpp"

#include <filesystem>
#include <string>

namespace decant {

/// Schema version of reference files; a reader refuses any other.
inline constexpr std::int64_t reference_schema = 1;

/// Constant c where the file states none: a vector with a quotient (tolerance.hpp).
inline constexpr double default_roundings = 8;

/// Every field of every state of the reference, and of the results. Rows have the check `fields`;
/// the fixture is the reference's name and the state's. Throws InputError naming file, dataset and
/// what is wrong: a shape that is not [N…], a reference that is not finite, a negative
/// tolerance, a condition sum without its number of terms.
/// \param name  stands as the rows' backend, "file" as their executor
CheckedResults check_named_fields(const std::filesystem::path& reference, const std::filesystem::path& results,
                                  const std::string& name);

}  // namespace decant
