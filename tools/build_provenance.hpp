/// \file
/// What this build is, as every file it writes says.
#pragma once

#include "version.hpp"

#include <map>
#include <string>

namespace decant {

/// version, git_revision, compiler, flags, build_type.
inline std::map<std::string, std::string> build_provenance() {
  return {{"version", version},
          {"git_revision", git_revision},
          {"compiler", compiler},
          {"flags", flags},
          {"build_type", build_type}};
}

}  // namespace decant
