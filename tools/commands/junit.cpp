/// \file
/// Suites, cases and their counts.
#include "tools/commands/junit.hpp"

#include "oracle/report/console_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace decant {
namespace {

constexpr std::string_view replacement = "\xEF\xBF\xBD";  // U+FFFD

struct Case {
  std::string fixture, check;
  std::vector<const CheckRow*> rows;

  bool has(Verdict verdict) const {
    return std::any_of(rows.begin(), rows.end(), [&](const CheckRow* row) { return judged_verdict(*row) == verdict; });
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
  std::string attributes() const {
    return fmt::format(R"(tests="{}" failures="{}" errors="0" skipped="{}")", tests, failures, skipped);
  }
};

/// The row of the largest score among those of a verdict; NaN is the largest.
const CheckRow& worst_of(const Case& c, Verdict verdict) {
  const CheckRow* worst = nullptr;
  for (const CheckRow* row : c.rows) {
    if (judged_verdict(*row) != verdict) continue;
    if (!worst || std::isnan(row->score) || row->score > worst->score) worst = row;
  }
  return *worst;
}

std::string message_of(const CheckRow& row) {
  if (row.n == 0) return check_label(row) + ": " + judged_reason(row);
  const auto unit = row.unit.empty() || row.unit == "1" ? "" : " " + row.unit;
  const auto where = row.worst_id >= 0 ? fmt::format(", particle {}", row.worst_id) : "";
  return fmt::format("{}{}: value {:.6g}{}, tolerance {:.6g}{}, score {:.4g}", check_label(row), where, row.value, unit,
                     row.tolerance, unit, row.score);
}

std::string case_xml(const Suite& suite, const Case& c) {
  std::string xml = fmt::format(R"(    <testcase classname="{}.{}" name="{}")", xml_escaped(suite.name),
                                xml_escaped(c.fixture), xml_escaped(c.check));
  if (c.fails()) {
    std::string text;
    for (const CheckRow* row : c.rows)
      if (judged_verdict(*row) != Verdict::pass) text += in_full(*row);
    return xml + fmt::format(
                     ">\n      <failure type=\"{}\" message=\"{}\">{}</failure>\n"
                     "    </testcase>\n",
                     xml_escaped(c.check), xml_escaped(message_of(worst_of(c, Verdict::fail))), xml_escaped(text));
  }
  if (c.skipped())
    return xml + fmt::format(">\n      <skipped message=\"{}\"/>\n    </testcase>\n",
                             xml_escaped(judged_reason(worst_of(c, Verdict::not_run))));
  return xml + "/>\n";
}

std::string properties_xml(const std::map<std::string, std::string>& provenance) {
  std::string xml = "    <properties>\n";
  for (const auto& [name, value] : provenance)
    xml += fmt::format("      <property name=\"{}\" value=\"{}\"/>\n", xml_escaped(name), xml_escaped(value));
  return xml + "    </properties>\n";
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

std::string xml_escaped(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    std::size_t length = 1;
    switch (text[0]) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&apos;";
        break;
      case '\r':
        out += "&#13;";
        break;
      case '\t':
      case '\n':
        out += text[0];
        break;
      default:
        length = character_length(text);
        out += length > 0 ? text.substr(0, length) : replacement;
        length = std::max<std::size_t>(length, 1);
    }
    text.remove_prefix(length);
  }
  return out;
}

std::string junit_xml(const Report& report) {
  const auto suites = suites_of(report);
  Counts all;
  for (const Suite& suite : suites) all.add(suite);
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  xml += fmt::format("<testsuites name=\"decant conform\" {}>\n", all.attributes());
  for (const Suite& suite : suites) {
    Counts counts;
    counts.add(suite);
    xml += fmt::format("  <testsuite name=\"{}\" {}>\n", xml_escaped(suite.name), counts.attributes());
    xml += properties_xml(report.provenance);
    for (const Case& c : suite.cases) xml += case_xml(suite, c);
    xml += "  </testsuite>\n";
  }
  return xml + "</testsuites>\n";
}

}  // namespace decant
