/// \file
/// How OpenMP's threads wait for each other.
#pragma once

namespace decant {

/// Has them sleep instead of spin, so that other work on the machine does not slow each of the many short
/// loops of a substep tenfold; on a quiet machine it makes no difference. The runtime reads its settings
/// before main begins, so the program starts itself once more. Leaves alone who sets OMP_WAIT_POLICY,
/// GOMP_SPINCOUNT or KMP_BLOCKTIME. To be called first of all. \param argv  of main
void let_waiting_threads_sleep(char** argv);

}  // namespace decant
