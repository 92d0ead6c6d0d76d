/// \file
/// How a state becomes a frame.
#pragma once

#include "reference/state.hpp"
#include "tools/frames/frame_file.hpp"

namespace decant::frames {

/// A frame of one state but for its places: rounded to fp32, moving walls posed at its time. `fields` gives density
/// and pressure.
Frame make_frame(const Scene& scene, const Layout& layout, std::int64_t index, const ParticleState& state,
                 const Fields& fields);

}  // namespace decant::frames
