/// \file
/// What a set of problems varies of a scene: the values at every leaf key of the scene's schema, and aspects
/// that no single key shows (a wall viscosity that does not follow from the viscosity, a tilted box).
#pragma once

#include "oracle/solution/fixture.hpp"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace decant::test {

/// Every leaf of a scene file by its path, "containers[].tilt.keys[].angle": a key whose value is no object
/// and no list of objects.
/// \param schema  fixtures/scenes/scene.schema.json
std::set<std::string> leaf_keys(const nlohmann::json& schema);

/// Keys that do not change the answer from a given state, each with the reason.
const std::map<std::string, std::string>& keys_without_influence();

/// A scene or state that no single key shows.
struct Aspect {
  const char* name;
  bool (*holds)(const Fixture&);
};
const std::vector<Aspect>& aspects();

/// What problems vary.
struct Coverage {
  /// By leaf key, then by value as the canonical text writes it ("-": not there): who has it.
  std::map<std::string, std::map<std::string, std::set<std::string>>> values;
  /// By aspect: who has it.
  std::map<std::string, std::set<std::string>> aspects;
  std::set<std::string> problems;
  /// The state is looked at by the aspects alone.
  void add(const std::set<std::string>& keys, const Fixture& problem);
  /// "contact.friction: 0.3 alone" for each of the keys that has one value, "tilted box: in none" for each
  /// aspect that none has, or all have.
  std::vector<std::string> gaps(const std::set<std::string>& keys) const;
};

std::set<std::string> leaf_keys_of_scenes();  // of fixtures/scenes/scene.schema.json
/// The recordings in fixtures/ (not those that fuzzing found).
Coverage coverage_of_fixtures();
/// Problems of the seeds from 1 on.
Coverage coverage_of_fuzzing(int problems);

/// Both as a table for people.
std::string coverage_table(const Coverage& fixtures, const Coverage& fuzzing);

}  // namespace decant::test
