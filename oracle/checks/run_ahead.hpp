/// \file
/// The reference's own run of a fixture, interrupted and sampled as a backend's run will be.
#pragma once

#include "oracle/checks/conform.hpp"

#include <functional>
#include <vector>

namespace decant {

/// Where a run of the fixture is interrupted, whatever is asked of it: the same run every time.
/// \param sample_every  as of prepare_reference
std::vector<Segment> segments_of(const Fixture& fixture, int sample_every);

/// Runs through prepared.segments and keeps what mass and containment compare with.
/// \param advance  so many substeps onward; the state then
void run_ahead(const Fixture& fixture, PreparedReference& prepared,
               const std::function<ParticleState(int substeps)>& advance);

}  // namespace decant
