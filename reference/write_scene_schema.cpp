/// \file
/// Prints the JSON Schema of scene files; reference/README.md says when to.
#include "reference/scene_schema.hpp"

#include <iostream>

int main() {
  std::cout << decant::scene_schema() << std::flush;
  return std::cout ? 0 : 1;
}
