/// \file
/// The one definition, so that a commit compiles this file anew and not those that ask.
#include "tools/common/build_provenance.hpp"

#include "version.hpp"

namespace decant {

std::map<std::string, std::string> build_provenance() {
  return {{"version", version},
          {"git_revision", git_revision},
          {"compiler", compiler},
          {"flags", flags},
          {"build_type", build_type}};
}

}  // namespace decant
