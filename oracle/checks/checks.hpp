/// \file
/// The checks by name, and what each compares and why its bound is what it is.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace decant {

struct CheckDescription {
  const char* name;
  const char* compares;
  const char* bound;  // and where it comes from
  const char* blind;  // what this check cannot see
};

/// In the order in which they are made: fields, substep, contact, advanced, trajectory, mass, containment,
/// determinism, conservation, invariance, status.
const std::vector<CheckDescription>& check_descriptions();

/// Names of checks that are wanted.
using CheckSelection = std::set<std::string>;

CheckSelection all_checks();

/// The check that gives rows of this name: `fields` of neighbors, density, …, else the one of that name; empty where any
/// check may give them (`run`), or none does.
std::string check_of_row(const std::string& row);

/// Throws InputError naming the check that does not exist.
CheckSelection parse_checks(const std::vector<std::string>& names);

}  // namespace decant
