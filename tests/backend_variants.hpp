/// \file
/// The backends under test with the options that change how they find neighbors.
#pragma once

#include "gpu/backends.hpp"

#include <gtest/gtest.h>

#include <cctype>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace decant::test {

/// A backend's NAME or NAME:OPTIONS on an executor.
struct Variant {
  std::string name;
  Executor executor;
};
inline void PrintTo(const Variant& variant, std::ostream* out) { *out << variant.name; }

/// Of which none repeats another. Capacities of 2 are there to overflow.
inline std::vector<Variant> backend_variants() {
  const std::vector<std::string> names = {"brute",
                                          "hash",
                                          "hash:wall_cells=off",
                                          "hash:moving_walls=rebuilt",
                                          "hash:sort=thrust",
                                          "hash:moving_walls=rebuilt:sort=thrust",
                                          "hash:force_neighbors=recomputed",
                                          "hash:threads_per_particle=4:capacity=2",
                                          "hash:threads_per_particle=1:launch=stream",
                                          "hash:ranks=3",
                                          "hash:ranks=2:force_neighbors=recomputed:halo_margin=0.1",
                                          "list",
                                          "list:ranks=3",
                                          "list:tiles=on",
                                          "list:tiles=off",
                                          "list:launch=graph",
                                          "list:build=all-pairs",
                                          "list:rebuild=3:skin=0.3",
                                          "list:criterion=relative",
                                          "list:criterion=relative:skin=0.05:threads_per_particle=8",
                                          "list:skin=0.4:threads_per_particle=1:capacity=2"};
  std::vector<Variant> all;
  for (const Executor executor : {Executor::host, Executor::cuda})
    for (const std::string& name : names)
      if (name != (executor == Executor::host ? "list:tiles=off" : "list:tiles=on")) all.push_back({name, executor});
  return all;
}

inline std::unique_ptr<Backend> make_variant(const std::string& variant, Executor executor) {
  const auto colon = variant.find(':');
  return make_backend(variant.substr(0, colon), executor, colon == std::string::npos ? "" : variant.substr(colon + 1));
}

inline std::unique_ptr<Backend> make_variant(const Variant& variant) {
  return make_variant(variant.name, variant.executor);
}

/// Letters and digits alone, for the name of a test.
inline std::string plain_name(const std::string& variant, Executor executor) {
  std::string name;
  for (const char c : variant) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name + (executor == Executor::host ? "Host" : "Cuda");
}
inline std::string variant_name(const testing::TestParamInfo<Variant>& info) {
  return plain_name(info.param.name, info.param.executor);
}

/// Of a test that runs on every executor.
inline std::string executor_name(const testing::TestParamInfo<Executor>& info) {
  return info.param == Executor::host ? "Host" : "Cuda";
}

}  // namespace decant::test
