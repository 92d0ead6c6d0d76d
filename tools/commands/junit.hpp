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

/// Text as it may stand in an XML element or attribute (where readers take line feeds for spaces):
/// markup as references; what is no UTF-8, and control characters, which XML cannot hold, as
/// U+FFFD.
std::string xml_escaped(std::string_view text);

}  // namespace decant
