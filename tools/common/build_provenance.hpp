/// \file
/// What this build is, as every file it writes says.
#pragma once

#include <map>
#include <string>

namespace decant {

/// version, git_revision, compiler, flags, build_type of this program.
std::map<std::string, std::string> build_provenance();

}  // namespace decant
