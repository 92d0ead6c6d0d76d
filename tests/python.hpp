/// \file
/// The Python that ci/setup makes, for tests of scripts and of what other programs read.
#pragma once

#include <cstdlib>
#include <string>

#include <sys/wait.h>

namespace decant::test {

inline std::string python() { return DECANT_SOURCE_DIR "/build/venv/bin/python"; }

/// Whether it is there and has these modules, comma-separated.
inline bool python_has(const std::string& modules) {
  return std::system(("'" + python() + "' -c 'import " + modules + "' 2>/dev/null").c_str()) == 0;
}

/// Exit status of a run with these arguments, as a shell reads them; its output goes to the test's.
inline int run_python(const std::string& arguments) {
  const int status = std::system(("'" + python() + "' " + arguments).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace decant::test
