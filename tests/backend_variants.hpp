/// \file
/// The backends under test with the options that change how they find neighbors.
#pragma once

#include "gpu/backends.hpp"

#include <cctype>
#include <memory>
#include <string>
#include <vector>

namespace decant::test {

/// NAME or NAME:OPTIONS. Capacities of 2 are there to overflow.
inline std::vector<std::string> backend_variants() {
  return {"brute",
          "hash",
          "hash:grid=fluid",
          "hash:source=rebuilt",
          "hash:sort=thrust",
          "hash:source=rebuilt:sort=thrust",
          "hash:pairs=rescan",
          "hash:lanes=4:capacity=2",
          "hash:lanes=1:launch=plain",
          "list",
          "list:launch=graphs",
          "list:build=all-pairs",
          "list:rebuild=3:skin=0.3",
          "list:trigger=local",
          "list:trigger=local:skin=0.05:lanes=8",
          "list:skin=0.4:lanes=1:capacity=2"};
}

inline std::unique_ptr<Backend> make_variant(const std::string& variant, Executor executor) {
  const auto colon = variant.find(':');
  return make_backend(variant.substr(0, colon), executor,
                      colon == std::string::npos ? "" : variant.substr(colon + 1));
}

/// Letters and digits alone, for the name of a test.
inline std::string plain_name(const std::string& variant, Executor executor) {
  std::string name;
  for (const char c : variant)
    name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name + (executor == Executor::host ? "Host" : "Cuda");
}

}  // namespace decant::test
