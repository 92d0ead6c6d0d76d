/// \file
/// `decant pour` in the process of a test.
#pragma once

#include "tools/commands/commands.hpp"

#include <string>
#include <vector>

namespace decant::test {

/// What `decant pour …` throws or leaves as its exit status.
inline int pour_command(const std::vector<std::string>& arguments) {
  CLI::App app;
  int status = -1;
  add_pour_command(app, status);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  reversed.push_back("pour");
  app.parse(reversed);
  return status;
}

}  // namespace decant::test
