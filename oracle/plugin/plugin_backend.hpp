/// \file
/// A plug-in (oracle/plugin.h) as a backend: in a process of its own, so that what it does to its memory, or a call
/// that never ends, is a failing row and nothing more.
#pragma once

#include "oracle/backend.hpp"

#include <memory>
#include <string>

namespace decant {

/// Seconds that a call may take unless `time_limit=SECONDS` is among the options.
inline constexpr double plugin_time_limit = 60;

/// Starts the plug-in's process. Throws InputError where the file is none, is no plug-in, or refuses the options.
/// \param choice  "PATH" or "PATH:key=value:…"; all but time_limit is the plug-in's
std::unique_ptr<Backend> make_plugin_backend(const std::string& choice);

/// The same of a Python class (tools/package): in a Python of its own, DECANT_PYTHON or the PATH's python3, which has
/// the package. \param choice  "FILE:CLASS" or "MODULE:CLASS", and options as above
std::unique_ptr<Backend> make_python_backend(const std::string& choice);

}  // namespace decant
