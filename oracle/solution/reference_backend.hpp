/// \file
/// The sequential solver behind the Backend interface, so that it can pour, record and be wrapped.
#pragma once

#include "oracle/backend.hpp"

#include "reference/neighbors.hpp"

#include <memory>

namespace decant {

/// Double precision; either search gives the same bits.
std::unique_ptr<Backend> make_reference_backend(NeighborSearch search = NeighborSearch::cells);

}  // namespace decant
