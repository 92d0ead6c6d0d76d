/// \file
/// Where this build has put what tests run. In a file of its own, so that builds differ in that file alone and a
/// compiler's cache serves all of them.
#pragma once

#include <string>

namespace decant::test {

/// The file of `decant`.
std::string command_file();
/// The same as a word of the shell.
std::string command();
/// The file of a plug-in of tests/plugins.
std::string plugin_file(const std::string& name);

}  // namespace decant::test
