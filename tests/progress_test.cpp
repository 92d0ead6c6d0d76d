/// \file
/// A line of progress fits the terminal that it is drawn on.
#include "tools/common/progress.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace decant {
namespace {

const std::string progress_text = "check 12/93, 41 s left, pour-4k-dense-walls-stream list";

TEST(ProgressLine, FitsEveryTerminal) {
  for (std::size_t columns = 1; columns <= 200; ++columns)
    for (const double share : {-1.0, 0.0, 0.3, 1.0, 7.0}) {
      const std::string line = progress_line(columns, share, progress_text);
      EXPECT_LT(line.size(), std::max<std::size_t>(columns, 2)) << columns;
      // What was drawn before is cleared as one line.
      EXPECT_EQ(line.find('\n'), std::string::npos);
    }
}

TEST(ProgressLine, GivesUpTheBarBeforeTheText) {
  EXPECT_EQ(progress_line(40, 0.5, progress_text), progress_text.substr(0, 39));
  EXPECT_EQ(progress_line(progress_text.size() + 1, 0.5, progress_text), progress_text);
  const std::string wide = progress_line(160, 0.5, progress_text);
  EXPECT_EQ(wide, "[" + std::string(14, '#') + std::string(14, '.') + "] " + progress_text);
  EXPECT_EQ(std::count(wide.begin(), wide.end(), '#'), 14);
}

}  // namespace
}  // namespace decant
