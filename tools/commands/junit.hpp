/// \file
/// A conformance report as JUnit XML, the form in which CI systems show what failed.
#pragma once

#include "oracle/report/report.hpp"

#include <string>
#include <string_view>

namespace decant {

/// One testsuite a backend, options and executor; one testcase a fixture and check, over its
/// fields. A case fails where a row of it fails (the message tells the worst, the text all that did
/// not pass), and is skipped where none fails and one did not run.
std::string junit_xml(const Report& report);

/// Text with U+FFFD for what XML 1.0 cannot hold: bytes that are no UTF-8, and control characters, which pugixml
/// would write as references that no reader accepts.
std::string xml_text(std::string_view text);

}  // namespace decant
