/// \file
/// The sequential solver behind the Backend interface, so that it can pour, record and be wrapped.
#pragma once

#include "oracle/backend.hpp"

#include <memory>

namespace decant {

/// Double precision, neighbors by cells.
std::unique_ptr<Backend> make_reference_backend();

}  // namespace decant
