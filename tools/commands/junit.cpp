/// \file
/// Suites, cases and their counts.
#include "tools/commands/junit.hpp"

#include "oracle/report/console_table.hpp"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <vector>

namespace decant {
namespace {

constexpr std::string_view replacement = "\xEF\xBF\xBD";  // U+FFFD

struct Case {
  std::string fixture, check;
  std::vector<const CheckRow*> rows;

  bool has(Verdict verdict) const {
    return std::any_of(rows.begin(), rows.end(), [&](const CheckRow* row) { return verdict_of(*row) == verdict; });
  }
  bool fails() const { return has(Verdict::fail); }
  bool skipped() const { return !fails() && has(Verdict::not_run); }
};

struct Suite {
  std::string name;
  std::vector<Case> cases;
};

std::vector<Suite> suites_of(const Report& report) {
  std::vector<Suite> suites;
  for (const CheckRow& row : report.rows) {
    const std::string name = backend_label(row);
    auto suite = std::find_if(suites.begin(), suites.end(), [&](const Suite& s) { return s.name == name; });
    if (suite == suites.end()) suite = suites.insert(suites.end(), {name, {}});
    auto& cases = suite->cases;
    auto found = std::find_if(cases.begin(), cases.end(),
                              [&](const Case& c) { return c.fixture == row.fixture && c.check == row.check; });
    if (found == cases.end()) found = cases.insert(cases.end(), {row.fixture, row.check, {}});
    found->rows.push_back(&row);
  }
  return suites;
}

struct Counts {
  std::size_t tests = 0, failures = 0, skipped = 0;

  void add(const Suite& suite) {
    for (const Case& c : suite.cases) {
      ++tests;
      failures += c.fails();
      skipped += c.skipped();
    }
  }
  void write(pugi::xml_node node) const {
    node.append_attribute("tests") = tests;
    node.append_attribute("failures") = failures;
    node.append_attribute("errors") = 0;
    node.append_attribute("skipped") = skipped;
  }
};

/// The row of the largest score among those of a verdict; NaN is the largest.
const CheckRow& worst_of(const Case& c, Verdict verdict) {
  const CheckRow* worst = nullptr;
  for (const CheckRow* row : c.rows) {
    if (verdict_of(*row) != verdict) continue;
    if (!worst || std::isnan(row->score) || row->score > worst->score) worst = row;
  }
  return *worst;
}

std::string message_of(const CheckRow& row) {
  if (row.n == 0) return check_label(row) + ": " + reason_of(row);
  const auto unit = row.unit.empty() || row.unit == "1" ? "" : " " + row.unit;
  const auto where = row.worst_id >= 0 ? fmt::format(", particle {}", row.worst_id) : "";
  return fmt::format("{}{}: error {:.6g}{}, tolerance {:.6g}{}, score {:.4g}", check_label(row), where, row.error, unit,
                     row.tolerance, unit, row.score);
}

void set(pugi::xml_node node, const char* name, std::string_view value) {
  node.append_attribute(name).set_value(xml_text(value).c_str());
}

void add_case(pugi::xml_node suite, const std::string& name, const Case& c) {
  pugi::xml_node node = suite.append_child("testcase");
  set(node, "classname", name + "." + c.fixture);
  set(node, "name", c.check);
  if (c.fails()) {
    std::string text;
    for (const CheckRow* row : c.rows)
      if (verdict_of(*row) != Verdict::pass) text += in_full(*row);
    pugi::xml_node failure = node.append_child("failure");
    set(failure, "type", c.check);
    set(failure, "message", message_of(worst_of(c, Verdict::fail)));
    failure.text().set(xml_text(text).c_str());
  } else if (c.skipped()) {
    set(node.append_child("skipped"), "message", reason_of(worst_of(c, Verdict::not_run)));
  }
}

void add_properties(pugi::xml_node suite, const std::map<std::string, std::string>& provenance) {
  pugi::xml_node properties = suite.append_child("properties");
  for (const auto& [name, value] : provenance) {
    pugi::xml_node property = properties.append_child("property");
    set(property, "name", name);
    set(property, "value", value);
  }
}

/// Bytes of the UTF-8 character that the text begins with; 0 where it is none that XML holds.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  if (byte(0) < 0x80) return byte(0) >= 0x20 && byte(0) != 0x7F ? 1 : 0;
  const std::size_t length = byte(0) >= 0xF0 ? 4 : byte(0) >= 0xE0 ? 3 : 2;
  if (byte(0) < 0xC2 || byte(0) > 0xF4 || text.size() < length) return 0;
  std::uint32_t code = byte(0) & (0x7Fu >> length);
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte(k) & 0x3Fu);
  }
  const bool overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool no_character = (code >= 0xD800 && code < 0xE000) || code == 0xFFFE || code == 0xFFFF || code > 0x10FFFF;
  return overlong || no_character ? 0 : length;
}

}  // namespace

std::string xml_text(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const bool space = text[0] == '\t' || text[0] == '\n' || text[0] == '\r';
    std::size_t length = space ? 1 : character_length(text);
    out += length > 0 ? text.substr(0, length) : replacement;
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

std::string junit_xml(const Report& report) {
  const auto suites = suites_of(report);
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  set(declaration, "version", "1.0");
  set(declaration, "encoding", "UTF-8");
  pugi::xml_node root = document.append_child("testsuites");
  set(root, "name", "decant conform");
  Counts all;
  for (const Suite& suite : suites) all.add(suite);
  all.write(root);
  for (const Suite& suite : suites) {
    pugi::xml_node node = root.append_child("testsuite");
    set(node, "name", suite.name);
    Counts counts;
    counts.add(suite);
    counts.write(node);
    add_properties(node, report.provenance);
    for (const Case& c : suite.cases) add_case(node, suite.name, c);
  }
  std::ostringstream out;
  document.save(out, "  ");
  return out.str();
}

}  // namespace decant
