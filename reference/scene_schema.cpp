/// \file
/// Which words of JSON Schema say what a ValueFormat says, and how the file is laid out: what fits a line
/// is one.
#include "reference/scene_schema.hpp"

#include "reference/scene_format.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

namespace decant {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t line_width = 120;

/// Whole numbers without a fraction.
ordered_json plain(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return static_cast<std::int64_t>(value);
  return value;
}

ordered_json plain(const ordered_json& value) {
  if (value.is_number_float()) return plain(value.get<double>());
  ordered_json out = value;
  if (value.is_array())
    for (ordered_json& item : out) item = plain(ordered_json(item));
  return out;
}

ordered_json schema_of(const ValueFormat& value);

/// Writes what a type says into the schema of a value.
struct TypeWriter {
  ordered_json& out;

  void operator()(const NumberFormat& number) const {
    if (!number.only.empty()) {
      out["enum"] = number.only;
      return;
    }
    out["type"] = "number";
    if (std::isfinite(number.range.low))
      out[number.range.low_open ? "exclusiveMinimum" : "minimum"] = plain(number.range.low);
    if (std::isfinite(number.range.high)) out["maximum"] = plain(number.range.high);
  }
  void operator()(const IntegerFormat& integer) const {
    if (integer.low == integer.high) {
      out["const"] = integer.low;
      return;
    }
    out["type"] = "integer";
    out["minimum"] = integer.low;
    out["maximum"] = integer.high;
  }
  void operator()(const BooleanFormat&) const { out["type"] = "boolean"; }
  void operator()(const TextFormat&) const { out["type"] = "string"; }
  void operator()(const NameFormat&) const {
    out["type"] = "string";
    out["pattern"] = "^[A-Za-z0-9_][A-Za-z0-9._-]{0,63}$";
  }
  void operator()(const ChoiceFormat& choice) const { out["enum"] = choice.options; }
  void operator()(const ArrayFormat& array) const {
    out["type"] = "array";
    if (array.items.size() == 1) {
      out["items"] = schema_of(array.items.front());
    } else {
      for (const ValueFormat& item : array.items) out["prefixItems"].push_back(schema_of(item));
    }
    if (array.unique) out["uniqueItems"] = true;
    if (array.fewest > 0) out["minItems"] = array.fewest;
    out["maxItems"] = array.most;
  }
  void operator()(const ObjectReference& object) const { out["$ref"] = "#/$defs/" + object.name; }
};

ordered_json schema_of(const ValueFormat& value) {
  ordered_json out = ordered_json::object();
  if (!value.description.empty()) out["description"] = value.description;
  std::visit(TypeWriter{out}, value.type);
  return out;
}

/// Adds to `out` what an object says but for its description.
void write_object(const ObjectFormat& object, ordered_json& out) {
  out["type"] = "object";
  out["additionalProperties"] = false;
  ordered_json required = ordered_json::array();
  for (const Member& member : object.members)
    if (member.required) required.push_back(member.key);
  if (!required.empty()) out["required"] = required;
  for (const Member& member : object.members) {
    ordered_json& property = out["properties"][member.key];
    property = schema_of(member.value);
    if (!member.otherwise.is_null()) property["default"] = plain(member.otherwise);
  }
  for (const auto& keys : object.alternatives.keys) {
    out[object.alternatives.exactly_one ? "oneOf" : "anyOf"].push_back({{"required", {keys.front()}}});
    if (keys.size() > 1)
      out["dependentRequired"][keys.front()] = std::vector<std::string>(keys.begin() + 1, keys.end());
  }
}

std::string in_brackets(const ordered_json& value, const std::string& inside) {
  return value.is_object() ? fmt::format("{{{}}}", inside) : fmt::format("[{}]", inside);
}

std::string on_one_line(const ordered_json& value) {
  if (!value.is_structured()) return value.dump();
  std::string inside;
  for (const auto& [key, item] : value.items())
    inside +=
        (inside.empty() ? "" : ", ") + (value.is_object() ? ordered_json(key).dump() + ": " : "") + on_one_line(item);
  return in_brackets(value, inside);
}

/// \param indent  columns before the line; \param taken  columns of it that are not the value's
std::string laid_out(const ordered_json& value, std::size_t indent, std::size_t taken) {
  const std::string whole = on_one_line(value);
  if (!value.is_structured() || indent + taken + whole.size() <= line_width) return whole;
  std::string inside;
  for (const auto& [key, item] : value.items()) {
    const std::string before = value.is_object() ? ordered_json(key).dump() + ": " : "";
    inside += (inside.empty() ? "\n" : ",\n") + std::string(indent + 2, ' ') + before +
              laid_out(item, indent + 2, before.size() + 1);
  }
  inside.append(1, '\n').append(indent, ' ');
  return in_brackets(value, inside);
}

}  // namespace

std::string scene_schema() {
  ordered_json out;
  out["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  out["title"] = "Decant scene";
  for (const ObjectFormat& object : scene_format())
    if (object.name == "scene") {
      out["description"] = object.description + " Generated from reference/scene_format.cpp, which the parser reads.";
      write_object(object, out);
    } else {
      ordered_json& definition = out["$defs"][object.name];
      definition["description"] = object.description;
      write_object(object, definition);
    }
  return laid_out(out, 0, 0) + "\n";
}

}  // namespace decant
