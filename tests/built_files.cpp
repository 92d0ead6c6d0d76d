/// \file
/// Places that CMake knows.
#include "tests/built_files.hpp"

namespace decant::test {

std::string command_file() { return DECANT_COMMAND; }
std::string command() { return "'" + command_file() + "'"; }
std::string plugin_file(const std::string& name) { return DECANT_PLUGINS "/" + name + ".so"; }

}  // namespace decant::test
