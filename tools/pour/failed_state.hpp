/// \file
/// What is kept of a run that failed.
#pragma once

#include "oracle/backend.hpp"
#include "reference/scene.hpp"
#include "reference/state.hpp"

#include <filesystem>
#include <string>

namespace decant::pour {

/// Writes the last good state as a fixture that can be judged and run again. Returns what to say of it,
/// also where it could not be saved: "; the last good state, substep 15, is in DIR/failed-state.h5".
std::string save_failed_state(const std::filesystem::path& file, const Scene& scene, const ParticleState& good,
                              const BackendInfo& backend, const std::string& trouble);

}  // namespace decant::pour
