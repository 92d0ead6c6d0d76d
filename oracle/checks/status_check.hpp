/// \file
/// The check `status`: trouble that is made on purpose must be reported, with its particle and substep,
/// and none where there is none.
#pragma once

#include "oracle/backend.hpp"
#include "oracle/checks/comparison.hpp"
#include "reference/scene.hpp"

#include <cstdint>

namespace decant {

/// Few particles, far apart, without containers, floor and forces, in the scene's domain and at its time
/// step. Rows, each the number of reports that are not as they have to be:
///   none        a run without trouble
///   escaped     a particle leaves through each face of each free axis; two at once: the smaller id; one
///               after the other: the first
///   position    not a number and infinite, either sign, in each component, in a run; not a number also
///               in an evaluation
///   velocity    the same of velocities, in a run
/// A backend may refuse to load what is no finite number instead.
/// \param substep  at which states are loaded
void check_status(Backend& backend, const Scene& scene, std::int64_t substep, RowBuilder& builder);

}  // namespace decant
