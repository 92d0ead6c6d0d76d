/// \file
/// What a reader may do with any bytes: take them, or refuse them with something to go by.
#pragma once

#include "reference/error.hpp"

#include <cstdio>
#include <cstdlib>

namespace decant::readers {

[[noreturn]] inline void give_up(const char* what) {
  std::fprintf(stderr, "reader: %s\n", what);
  std::abort();
}

/// Runs `read`; whether the bytes were taken. Any exception but InputError ends the process.
template <class Read>
bool taken(Read read) {
  try {
    read();
    return true;
  } catch (const InputError& error) {
    if (error.file().empty() || error.key().empty() || error.bound().empty())
      give_up("refused without file, key or bound");
    return false;
  }
}

}  // namespace decant::readers
