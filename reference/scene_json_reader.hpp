/// \file
/// Strict reading of JSON: every value knows its file, its key path and its entry in scene_format(), so
/// that each refusal names them and every bound is the table's.
#pragma once

#include "reference/scene.hpp"
#include "reference/scene_format.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace decant {

/// A double as the shortest text that reads back to it.
std::string to_text(double value);

/// The value to five significant digits, for messages.
double rounded(double value);

/// One value of a JSON document, where it stands, and what it may be. Owns neither document nor format. To ask
/// for another type than the format's is a mistake of the caller: std::bad_variant_access; for a key that the
/// format lacks: std::logic_error.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& json, const ValueFormat& format, std::string file, std::string path)
      : json_(&json), format_(&format), file_(std::move(file)), path_(std::move(path)) {}

  /// Throws InputError unless this is an object that holds every required key and no unknown one.
  void check_keys() const;

  /// Throws InputError unless of the object's alternatives as many stand here as must.
  void check_alternatives() const;

  bool has(const std::string& key) const;

  /// The member of that name; the caller has made sure that it exists.
  JsonValue operator[](const std::string& key) const;

  /// The elements of an array. Throws InputError where they are too few or too many.
  std::vector<JsonValue> elements() const;

  /// A finite number in its range. Throws InputError.
  double number() const;

  /// An integer in its range, written without a fraction. Throws InputError.
  int integer() const;

  /// true or false. Throws InputError.
  bool boolean() const;

  /// Text. Throws InputError.
  std::string text() const;

  /// Text fit for a name (NameFormat). Throws InputError.
  std::string name() const;

  /// Which of its options this is, as an index. Throws InputError.
  std::size_t choice() const;

  /// An array of three numbers. Throws InputError.
  Vec3 vector() const;

  const std::string& path() const { return path_; }
  const std::string& file() const { return file_; }

  /// Throws InputError for this value.
  [[noreturn]] void refuse(const std::string& bound) const;

 private:
  template <class Type>
  const Type& type() const {
    return std::get<Type>(format_->type);
  }
  const ObjectFormat& object() const { return object_format(type<ObjectReference>().name); }

  const nlohmann::json* json_;
  const ValueFormat* format_;
  std::string file_, path_;
};

/// Parses JSON with comments. Throws InputError on bad syntax, on a number that no double holds and
/// on a key that stands twice in one object.
nlohmann::json parse_json(std::string_view text, const std::string& file);

}  // namespace decant
