/// \file
/// Every key that changes the answer varies, in recordings and in fuzzing; a key of tomorrow has to.
#include "tests/scene_coverage.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace decant::test {
namespace {

TEST(SceneCoverage, FindsTheLeavesOfASchema) {
  const auto schema = nlohmann::json::parse(R"({
    "properties": {
      "a": {"type": "number"},
      "b": {"$ref": "#/$defs/b"},
      "list": {"items": {"$ref": "#/$defs/b"}}
    },
    "$defs": {"b": {"properties": {"x": {"items": {"type": "number"}}, "deep": {"$ref": "#/$defs/c"}}},
              "c": {"properties": {"y": {}}}}})");
  EXPECT_EQ(leaf_keys(schema), (std::set<std::string>{"a", "b.x", "b.deep.y", "list[].x", "list[].deep.y"}));
}

TEST(SceneCoverage, KeysSaidToHaveNoInfluenceAreKeys) {
  const auto keys = leaf_keys_of_scenes();
  for (const auto& [key, reason] : keys_without_influence()) EXPECT_TRUE(keys.contains(key)) << key;
}

/// A new key of the scene fails here until a recording and the fuzzed problems have it in two values.
TEST(SceneCoverage, RecordingsVaryEveryKeyThatChangesTheAnswer) {
  const auto gaps = coverage_of_fixtures().gaps(leaf_keys_of_scenes());
  EXPECT_TRUE(gaps.empty()) << "vary these in a recording of fixtures/ (tools/python/record_hostile.py), or say in "
                               "keys_without_influence() why they change nothing:\n  "
                            << fmt::format("{}", fmt::join(gaps, "\n  "));
}

TEST(SceneCoverage, FuzzingVariesEveryKeyThatChangesTheAnswer) {
  const auto gaps = coverage_of_fuzzing(300).gaps(leaf_keys_of_scenes());
  EXPECT_TRUE(gaps.empty()) << "vary these in tools/fuzz/case.cpp and case_fixture.cpp, or say in "
                               "keys_without_influence() why they change nothing:\n  "
                            << fmt::format("{}", fmt::join(gaps, "\n  "));
}

TEST(SceneCoverage, WhatAllProblemsHaveAlikeIsAGap) {
  const auto keys = leaf_keys_of_scenes();
  Coverage one = coverage_of_fuzzing(1);
  const auto gaps = one.gaps(keys);
  const auto is_gap = [&](const std::string& key) {
    for (const std::string& gap : gaps)
      if (gap.starts_with(key + ":")) return true;
    return false;
  };
  EXPECT_TRUE(is_gap("mass_ratio"));
  EXPECT_TRUE(is_gap("contact.friction"));
  EXPECT_FALSE(is_gap("name"));
  // A key that the schema does not know is one too: the canonical text wrote it.
  auto fewer = keys;
  fewer.erase("fluid.viscosity");
  Coverage unknown;
  unknown.add(fewer, Fixture{});
  bool told = false;
  for (const std::string& gap : unknown.gaps(fewer)) told = told || gap.ends_with("fluid.viscosity");
  EXPECT_TRUE(told);
}

}  // namespace
}  // namespace decant::test
