/// \file
/// What CI systems are told: every failing check fails there, and what did not run is no pass.
#include "tools/commands/junit.hpp"

#include "oracle/files/file_aside.hpp"
#include "oracle/files/temporary_folder.hpp"
#include "tests/python.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace decant {
namespace {

CheckRow row(const std::string& backend, const std::string& check, const std::string& field, double score) {
  CheckRow r;
  r.backend = backend;
  r.executor = "host";
  r.fixture = "pour-4k-rest";
  r.check = check;
  r.field = field;
  r.unit = "kg/m^3";
  r.n = 4000;
  r.tolerance = 1e-4;
  r.score = score;
  r.error = score * r.tolerance;
  r.worst_id = 17;
  r.verdict = score <= 1 ? Verdict::pass : Verdict::fail;
  if (r.verdict == Verdict::fail) r.reason = "beyond tolerance";
  return r;
}

CheckRow not_run(const std::string& backend) {
  CheckRow r;
  r.backend = backend;
  r.executor = "cuda";
  r.fixture = "pour-4k-rest";
  r.check = "all";
  r.reason = "no CUDA device";
  return r;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(Junit, ACheckIsOneCaseHoweverManyFieldsItHas) {
  const std::string xml =
      junit_xml({{row("brute", "substep", "position", 0.5), row("brute", "substep", "velocity", 0.25),
                  row("brute", "density", "density", 0.1)},
                 {}});
  EXPECT_EQ(count(xml, "<testcase "), 2u) << xml;
  EXPECT_EQ(count(xml, R"(tests="2" failures="0" errors="0" skipped="0")"), 2u) << xml;
}

TEST(Junit, AFailureTellsTheWorstFieldWithParticleValueToleranceAndScore) {
  const std::string xml = junit_xml({{row("brute", "substep", "position", 3), row("brute", "substep", "velocity", 31),
                                      row("brute", "density", "density", 0.1)},
                                     {}});
  EXPECT_NE(xml.find("message=\"substep / velocity, particle 17: error 0.0031 kg/m^3, tolerance "
                     "0.0001 kg/m^3, score 31\""),
            std::string::npos)
      << xml;
  EXPECT_NE(xml.find("fail: brute host on pour-4k-rest: substep / position"), std::string::npos);
  EXPECT_EQ(count(xml, R"(tests="2" failures="1" errors="0" skipped="0")"), 2u) << xml;
}

TEST(Junit, WhatDidNotRunIsSkippedAndAPassWithoutAScoreFails) {
  CheckRow lie = row("brute", "density", "density", 0.5);
  lie.score = std::numeric_limits<double>::quiet_NaN();
  const std::string xml = junit_xml({{lie, not_run("list")}, {}});
  EXPECT_NE(xml.find("<skipped message=\"no CUDA device\" />"), std::string::npos) << xml;
  EXPECT_EQ(count(xml, "<failure "), 1u) << xml;
  EXPECT_NE(xml.find(R"(tests="2" failures="1" errors="0" skipped="1")"), std::string::npos) << xml;
}

TEST(Junit, AnEmptyReportHasNoCases) { EXPECT_NE(junit_xml({}).find(R"(tests="0")"), std::string::npos); }

TEST(XmlText, KeepsTextAndReplacesWhatXmlCannotHold) {
  EXPECT_EQ(xml_text("a<b> & \"c\" 'd'\n\te"), "a<b> & \"c\" 'd'\n\te");
  EXPECT_EQ(xml_text("ρ₀ 𝄞"), "ρ₀ 𝄞");
  EXPECT_EQ(xml_text(std::string("\0\x1b\x7f", 3)), "���");
  // A byte alone, one that goes on too soon, overlong, a surrogate, a character cut off.
  EXPECT_EQ(xml_text("\xff"), "�");
  EXPECT_EQ(xml_text("\x80z"), "�z");
  EXPECT_EQ(xml_text("\xe0\x80\x80"), "���");
  EXPECT_EQ(xml_text("\xed\xa0\x80"), "���");
  EXPECT_EQ(xml_text("\xf0\x9d"), "��");
}

TEST(Junit, IsReadByAnXmlParserWithEveryCharacterInItsPlace) {
  if (!test::python_has("xml.etree")) GTEST_SKIP() << "no " << test::python();
  const TemporaryFolder folder;
  CheckRow awkward = row("b<r>", "density", "den\"sity'", 31);
  awkward.reason = "]]> & <!-- \x1b ρ \xff";
  write_text_file(folder / "junit.xml", junit_xml({{awkward, row("brute", "density", "density", 0.5), not_run("list")},
                                                   {{"device.<x>", "a & b"}}}));
  write_text_file(folder / "read.py", R"(
import sys
from xml.etree import ElementTree
root = ElementTree.parse(sys.argv[1]).getroot()
assert [root.get(k) for k in ("tests", "failures", "errors", "skipped")] == ["3", "1", "0", "1"]
suites = root.findall("testsuite")
assert [s.get("name") for s in suites] == ["b<r> host", "brute host", "list cuda"]
for suite in suites:
    cases = suite.findall("testcase")
    assert int(suite.get("tests")) == len(cases) == 1
    assert int(suite.get("failures")) == len(suite.findall("testcase/failure"))
    assert int(suite.get("skipped")) == len(suite.findall("testcase/skipped"))
    assert suite.find("properties/property").attrib == {"name": "device.<x>", "value": "a & b"}
case = suites[0].find("testcase")
assert case.get("classname") == "b<r> host.pour-4k-rest" and case.get("name") == "density"
failure = case.find("failure")
assert failure.get("message").startswith("density / den\"sity', particle 17: error 0.0031 kg/m^3")
assert "]]> & <!-- \ufffd ρ \ufffd\n" in failure.text, failure.text
)");
  EXPECT_EQ(test::run_python({(folder / "read.py").string(), (folder / "junit.xml").string()}), 0);
}

}  // namespace
}  // namespace decant
