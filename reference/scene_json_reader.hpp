/// \file
/// Strict reading of JSON: every value knows its file and key path, so that each refusal names
/// them.
#pragma once

#include "reference/scene.hpp"
#include "reference/scene_file.hpp"

#include <nlohmann/json.hpp>

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace decant {

/// Which finite numbers are allowed.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;  // true: `low` itself is refused

  bool holds(double value) const { return (low_open ? value > low : value >= low) && value <= high; }
  /// As a reader of a message wants it: "a number > 0".
  std::string text() const;
};

/// A double as the shortest text that reads back to it.
std::string to_text(double value);

/// The value to five significant digits, for messages.
double rounded(double value);

/// One value of a JSON document and where it stands. Does not own the document.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& json, std::string file, std::string path)
      : json_(&json), file_(std::move(file)), path_(std::move(path)) {}

  /// Throws InputError unless this is an object that holds every required key and no unknown one.
  void check_keys(const ObjectKeys& keys) const;

  bool has(const std::string& key) const { return json_->contains(key); }

  /// The member of that name; the caller has made sure that it exists.
  JsonValue operator[](const std::string& key) const;

  /// The elements of an array of at least `fewest` and at most `most`. Throws InputError.
  std::vector<JsonValue> elements(std::size_t fewest, std::size_t most) const;

  /// A finite number in the range. Throws InputError.
  double number(const Range& range) const;

  /// An integer in low … high, written without a fraction. Throws InputError.
  int integer(int low, int high) const;

  /// true or false. Throws InputError.
  bool boolean() const;

  /// Text. Throws InputError.
  std::string text() const;

  /// Text fit for a name: letters, digits, '.', '-', '_', 1 to 64 of them. Throws InputError.
  std::string name() const;

  /// Which of the given texts this is, as an index. Throws InputError.
  std::size_t choice(const std::vector<std::string>& options) const;

  /// Three numbers in the range. Throws InputError.
  Vec3 vector(const Range& range) const;

  const std::string& path() const { return path_; }
  const std::string& file() const { return file_; }

  /// The value as a message shows it: one line, shortened where long.
  std::string shown() const;

  /// Throws InputError for this value.
  [[noreturn]] void refuse(const std::string& bound) const;

 private:
  const nlohmann::json* json_;
  std::string file_, path_;
};

/// Parses JSON with comments. Throws InputError on bad syntax, on a number that no double holds and
/// on a key that stands twice in one object.
nlohmann::json parse_json(std::string_view text, const std::string& file);

}  // namespace decant
