/// \file
/// Types, ranges and key paths of JSON values, and the syntax errors in words.
#include "reference/scene_json_reader.hpp"

#include "reference/error.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

namespace decant {
namespace {

using nlohmann::json;

constexpr std::size_t longest_shown = 60;

std::string shorten(std::string text) {
  if (text.size() <= longest_shown) return text;
  std::size_t cut = longest_shown;
  while (cut > 0 && (static_cast<unsigned char>(text[cut]) & 0xC0) == 0x80) --cut;
  return text.substr(0, cut) + "...";
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& w : words) all += (all.empty() ? "" : ", ") + w;
  return all;
}

/// The key as a path shows it; quoted where it is not a plain word.
std::string member_path(const std::string& path, const std::string& key) {
  const bool plain = !key.empty() && std::all_of(key.begin(), key.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '$' || c == '-';
  });
  return (path.empty() ? "" : path + ".") + (plain ? key : shorten(json(key).dump()));
}

/// The value as a message shows it: one line, shortened where long.
std::string shown(const json& value) { return shorten(value.dump(-1, ' ', false, json::error_handler_t::replace)); }

/// The range as a message says it: "a number > 0.0".
std::string bound_of(const Range& range) {
  const bool has_low = std::isfinite(range.low), has_high = std::isfinite(range.high);
  if (has_low && has_high)
    return std::string("a number in ") + (range.low_open ? "(" : "[") + to_text(range.low) + ", " +
           to_text(range.high) + "]";
  if (has_low) return std::string("a number ") + (range.low_open ? "> " : ">= ") + to_text(range.low);
  if (has_high) return "a number <= " + to_text(range.high);
  return "a number";
}

/// Follows the parser through the document, because the parser itself forgets where it is.
class Whereabouts {
 public:
  explicit Whereabouts(const std::string& file) : file_(file) {}

  bool see(json::parse_event_t event, const json& parsed) {
    switch (event) {
      case json::parse_event_t::key: {
        Level& level = levels_.back();
        level.key = parsed.get<std::string>();
        if (!level.keys.insert(*level.key).second)
          throw InputError(file_, path(), "given twice", "a key may stand once in an object");
        break;
      }
      case json::parse_event_t::object_start:
      case json::parse_event_t::array_start:
        levels_.push_back({event == json::parse_event_t::array_start, 0, {}, {}});
        break;
      case json::parse_event_t::object_end:
      case json::parse_event_t::array_end:
        levels_.pop_back();
        next_element();
        break;
      case json::parse_event_t::value:
        next_element();
        break;
    }
    return true;
  }

  std::string path() const {
    std::string path;
    for (const auto& level : levels_)
      if (level.is_array) path += "[" + std::to_string(level.index) + "]";
      else if (level.key) path = member_path(path, *level.key);
    return path;
  }

 private:
  struct Level {
    bool is_array;
    std::size_t index;
    std::optional<std::string> key;  // none before the first; the empty one is a key
    std::set<std::string> keys;
  };

  void next_element() {
    if (!levels_.empty() && levels_.back().is_array) ++levels_.back().index;
  }

  std::string file_;
  std::vector<Level> levels_;
};

/// "line 3, column 5" of a byte that the parser counts from 1.
std::string place_of(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte == 0 ? 0 : byte - 1, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_start = before.rfind('\n') + 1;  // npos + 1 is 0
  return "line " + std::to_string(line) + ", column " + std::to_string(before.size() - line_start + 1);
}

/// The parser's message without its own label and position.
std::string reason_of(const std::string& what) {
  const auto label = what.find("] ");
  std::string reason = label == std::string::npos ? what : what.substr(label + 2);
  const auto position = reason.find("column ");
  const auto colon = position == std::string::npos ? position : reason.find(": ", position);
  return colon == std::string::npos ? reason : reason.substr(colon + 2);
}

}  // namespace

std::string to_text(double value) {
  return std::isfinite(value) ? json(value).dump() : value > 0 ? "inf" : value < 0 ? "-inf" : "nan";
}

double rounded(double value) {
  if (value == 0 || !std::isfinite(value)) return value + 0.0;  // −0 reads as 0
  const double digits = 4 - std::floor(std::log10(std::abs(value)));
  if (std::abs(digits) > 300) return value;
  const double scale = std::pow(10.0, std::abs(digits));
  return digits >= 0 ? std::round(value * scale) / scale : std::round(value / scale) * scale;
}

void JsonValue::check_keys() const {
  const ObjectFormat& format = object();
  if (!json_->is_object()) refuse("an object {...} (" + format.name + ")");
  std::vector<std::string> known;
  for (const bool required : {true, false})
    for (const Member& member : format.members)
      if (member.required == required) known.push_back(member.key);
  for (const auto& [key, value] : json_->items())
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw InputError(file_, member_path(path_, key), shown(value), "no such key; known keys here: " + joined(known));
  for (const Member& member : format.members)
    if (member.required && !json_->contains(member.key))
      throw InputError(file_, member_path(path_, member.key), "missing",
                       "a required key; known keys here: " + joined(known));
}

void JsonValue::check_alternatives() const {
  const Alternatives& alternatives = object().alternatives;
  const auto stand = std::count_if(alternatives.keys.begin(), alternatives.keys.end(),
                                   [&](const auto& keys) { return has(keys.front()); });
  if (stand < 1 || (alternatives.exactly_one && stand > 1)) refuse(alternatives.bound);
}

bool JsonValue::has(const std::string& key) const { return json_->contains(member_of(object(), key).key); }

JsonValue JsonValue::operator[](const std::string& key) const {
  return {json_->at(key), member_of(object(), key).value, file_, member_path(path_, key)};
}

std::vector<JsonValue> JsonValue::elements() const {
  const auto& [items, fewest, most, unique] = type<ArrayFormat>();
  if (!json_->is_array()) refuse("an array [...]");
  const std::size_t n = json_->size();
  if (n < fewest || n > most)
    refuse("an array of " +
           (fewest == most ? std::to_string(fewest) : std::to_string(fewest) + " to " + std::to_string(most)) +
           " elements, not " + std::to_string(n));
  std::vector<JsonValue> all;
  for (std::size_t i = 0; i < n; ++i)
    all.emplace_back((*json_)[i], items.size() == 1 ? items[0] : items.at(i), file_,
                     path_ + "[" + std::to_string(i) + "]");
  return all;
}

double JsonValue::number() const {
  const auto& [range, only] = type<NumberFormat>();
  if (!json_->is_number()) refuse(bound_of(range));
  const double value = json_->get<double>();
  if (!std::isfinite(value) || !range.holds(value)) refuse(bound_of(range));
  if (!only.empty() && std::find(only.begin(), only.end(), value) == only.end()) {
    std::string bound;
    for (const int allowed : only) bound += (bound.empty() ? "" : " or ") + std::to_string(allowed);
    refuse(bound);
  }
  return value;
}

int JsonValue::integer() const {
  const auto& [low, high] = type<IntegerFormat>();
  const std::string bound = low == high ? "the integer " + std::to_string(low)
                                        : "an integer in [" + std::to_string(low) + ", " + std::to_string(high) + "]";
  if (!json_->is_number_integer()) refuse(bound);
  if (json_->is_number_unsigned() && json_->get<std::uint64_t>() > std::uint64_t{1} << 62) refuse(bound);
  const auto value = json_->get<std::int64_t>();
  if (value < low || value > high) refuse(bound);
  return static_cast<int>(value);
}

bool JsonValue::boolean() const {
  (void)type<BooleanFormat>();
  if (!json_->is_boolean()) refuse("true or false");
  return json_->get<bool>();
}

std::string JsonValue::text() const {
  (void)type<TextFormat>();
  if (!json_->is_string()) refuse("text in quotes");
  return json_->get<std::string>();
}

std::string JsonValue::name() const {
  (void)type<NameFormat>();
  // It becomes part of paths: "." is the group itself to HDF5, and "-x" an option to programs.
  const std::string bound = "a name of 1 to 64 letters, digits, '.', '-' or '_', the first no '.' and no '-'";
  if (!json_->is_string()) refuse(bound);
  const auto value = json_->get<std::string>();
  const bool plain = std::all_of(value.begin(), value.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-' ||
           c == '_';
  });
  if (value.empty() || value.size() > 64 || !plain || value[0] == '.' || value[0] == '-') refuse(bound);
  return value;
}

std::size_t JsonValue::choice() const {
  const auto& options = type<ChoiceFormat>().options;
  if (json_->is_string()) {
    const auto found = std::find(options.begin(), options.end(), json_->get<std::string>());
    if (found != options.end()) return static_cast<std::size_t>(found - options.begin());
  }
  refuse("one of " + joined(options));
}

Vec3 JsonValue::vector() const {
  const auto parts = elements();
  return {parts.at(0).number(), parts.at(1).number(), parts.at(2).number()};
}

void JsonValue::refuse(const std::string& bound) const {
  throw InputError(file_, path_.empty() ? "(whole file)" : path_, shown(*json_), bound);
}

json parse_json(std::string_view text, const std::string& file) {
  Whereabouts whereabouts(file);
  const auto where = [&] {
    const std::string path = whereabouts.path();
    return path.empty() ? std::string("(whole file)") : path;
  };
  try {
    return json::parse(
        text.begin(), text.end(),
        [&](int, json::parse_event_t event, json& parsed) { return whereabouts.see(event, parsed); }, true, true);
  } catch (const json::parse_error& error) {
    throw InputError(file, where(), place_of(text, error.byte),
                     "valid JSON (comments allowed); " + reason_of(error.what()));
  } catch (const json::out_of_range& error) {
    std::string number = reason_of(error.what());
    if (const auto quote = number.find('\''); quote != std::string::npos)
      number = number.substr(quote + 1, number.rfind('\'') - quote - 1);
    throw InputError(file, where(), shorten(number), "a finite number that a double can hold");
  }
}

}  // namespace decant
