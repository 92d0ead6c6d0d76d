/// \file
/// Wrong backends run in processes of their own: one that crashes or hangs takes nobody with it.
#pragma once

#include "gpu/backends.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace decant {

/// What a process said before it ended.
struct Said {
  std::string text;
  std::string ended;  // "": well; "crash" or "hang" by a signal, "failed" otherwise
};

/// say(k), k < count, each in a process of its own, `jobs` at a time, each for so many seconds of the processor at most.
/// What throws has failed, and standard error tells why.
std::vector<Said> in_processes(std::size_t count, int jobs, unsigned seconds,
                               const std::function<std::string(std::size_t)>& say);

/// The backend of "name" or "name:options".
std::unique_ptr<Backend> backend_of(const std::string& choice, Executor executor);

}  // namespace decant
