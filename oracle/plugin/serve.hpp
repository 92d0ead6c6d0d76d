/// \file
/// The process of a plug-in, whatever its table comes from: a library, or a class of another language.
#pragma once

#include "oracle/plugin.h"

#include <functional>

namespace decant {

/// A table, and what its create() made; destroy() is called with it in the end.
struct OpenPlugin {
  decant_plugin_table table;
  void* solver;
};

/// Answers requests over a socket until nobody asks any more. \param open  what it throws is told to who asks
void serve_plugin(int socket, const std::function<OpenPlugin()>& open);

}  // namespace decant
