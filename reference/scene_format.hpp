/// \file
/// The format of scene files as one table: objects, keys, types, bounds, defaults. The reader
/// (scene_json_reader.hpp) refuses by it and the JSON Schema (scene_schema.hpp) is generated from it, so
/// neither knows a key or a bound that the other does not. What needs more than one value to say (min below
/// max, times that increase) is the reader's alone.
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <limits>
#include <string>
#include <variant>
#include <vector>

namespace decant {

/// Which finite numbers are allowed.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;  // true: `low` itself is refused

  bool holds(double value) const { return (low_open ? value > low : value >= low) && value <= high; }
};

struct ValueFormat;

struct NumberFormat {
  Range range;
  std::vector<int> only = {};  // not empty: these numbers alone
};

/// low … high, written without a fraction.
struct IntegerFormat {
  int low, high;
};

struct BooleanFormat {};

struct TextFormat {};

/// Text that is fit to be part of a path: 1 to 64 letters, digits, '.', '-', '_', the first no '.' and no '-'.
struct NameFormat {};

struct ChoiceFormat {
  std::vector<std::string> options;
};

struct ArrayFormat {
  std::vector<ValueFormat> items;  // one: of every element; several: one for each of as many elements
  std::size_t fewest, most;        // elements
  bool unique = false;             // no two elements are equal
};

/// An object of scene_format(), by its name.
struct ObjectReference {
  std::string name;
};

/// One value: what it may be, and what it means (with its unit) in words for the schema.
struct ValueFormat {
  std::variant<NumberFormat, IntegerFormat, BooleanFormat, TextFormat, NameFormat, ChoiceFormat, ArrayFormat,
               ObjectReference>
      type;
  std::string description = {};
};

/// One key of an object.
struct Member {
  std::string key;
  ValueFormat value;
  bool required = false;                  // refused where missing
  nlohmann::ordered_json otherwise = {};  // what a missing one counts as; null: nothing, or it depends
};

/// Of the first keys of these alternatives exactly one, or at least one, stands in an object. The other keys
/// of an alternative are what its first takes.
struct Alternatives {
  std::vector<std::vector<std::string>> keys;
  bool exactly_one;
  std::string bound;  // the rule as a message says it
};

/// One kind of object.
struct ObjectFormat {
  std::string name;  // "scene", "fluid", "tilt_key", …; also its place in the schema
  std::string description;
  std::vector<Member> members;
  Alternatives alternatives = {{}, false, {}};  // no keys: no rule
};

/// Every object of the format, the whole scene first.
const std::vector<ObjectFormat>& scene_format();

/// The object of that name in scene_format(). Throws std::logic_error where there is none.
const ObjectFormat& object_format(const std::string& name);

/// The member of that key. Throws std::logic_error where there is none.
const Member& member_of(const ObjectFormat& object, const std::string& key);

}  // namespace decant
