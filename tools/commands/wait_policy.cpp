/// \file
/// One setting, one more start.
#include "tools/commands/wait_policy.hpp"

#include <unistd.h>
#include <cstdlib>
#include <initializer_list>

namespace decant {

void let_waiting_threads_sleep(char** argv) {
  for (const char* chosen : {"OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME"})
    if (std::getenv(chosen)) return;
  if (::setenv("OMP_WAIT_POLICY", "passive", 0) != 0) return;
  ::execv("/proc/self/exe", argv);
  // Where that cannot be, this start will do.
}

}  // namespace decant
