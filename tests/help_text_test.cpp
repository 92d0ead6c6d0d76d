/// \file
/// Help that fits 80 columns, and answers to a command line with a slip in it.
#include "tools/commands/help_text.hpp"

#include "tests/built_files.hpp"
#include "tests/shell_output.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace decant {
namespace {

TEST(Reflowed, BreaksParagraphsAndLeavesCommandsAlone) {
  EXPECT_EQ(reflowed("one two\nthree", 8), "one two\nthree");
  EXPECT_EQ(reflowed("one two three four", 9), "one two\nthree\nfour");
  EXPECT_EQ(reflowed("a\nb\n\nExample:\n  decant  conform --all  --quiet\nc", 20),
            "a b\n\nExample:\n  decant  conform --all  --quiet\nc");
  EXPECT_EQ(reflowed("a-word-that-is-longer than", 10), "a-word-that-is-longer\nthan");
  EXPECT_EQ(reflowed("  term  a meaning that is\n        long enough to break\n  next  b", 30),
            "  term  a meaning that is long\n        enough to break\n  next  b");
  EXPECT_EQ(reflowed("", 10), "");
}

TEST(NearestName, IsTheOneThatWasMeantOrNone) {
  const std::vector<std::string> verbs{"pour", "record", "conform", "diff", "drift"};
  EXPECT_EQ(nearest_name("confrom", verbs), "conform");
  EXPECT_EQ(nearest_name("rekord", verbs), "record");
  EXPECT_EQ(nearest_name("dif", verbs), "diff");
  EXPECT_EQ(nearest_name("xyzzy", verbs), "");
  EXPECT_EQ(nearest_name("", verbs), "");
}

test::ShellOutput answer_to(const std::string& arguments) {
  return test::shell_output(test::command() + " " + arguments);
}

TEST(Command, HelpOfEveryVerbFitsTheTerminalAndHasAnExample) {
  const test::ShellOutput all = answer_to("--help");
  std::vector<std::string> verbs{""};
  for (std::size_t at = all.text.find("Subcommands:"); (at = all.text.find("\n  ", at)) != std::string::npos;) {
    at += 3;
    const std::string word = all.text.substr(at, all.text.find_first_of(" \n", at) - at);
    if (word == "decant") break;
    if (!word.empty()) verbs.push_back(word);
  }
  EXPECT_EQ(verbs.size(), 12);
  for (const std::string& verb : verbs) {
    const test::ShellOutput help = answer_to(verb + " --help");
    EXPECT_EQ(help.status, 0) << verb;
    EXPECT_NE(help.text.find("\n  decant "), std::string::npos) << verb << " has no example";
    std::size_t from = 0;
    for (std::size_t to; (to = help.text.find('\n', from)) != std::string::npos; from = to + 1) {
      std::size_t columns = 0;
      for (std::size_t k = from; k < to; ++k) columns += (help.text[k] & 0xC0) != 0x80;
      EXPECT_LE(columns, help_width) << verb << ": " << help.text.substr(from, to - from);
    }
  }
}

TEST(Command, SaysWhatWasProbablyMeant) {
  EXPECT_EQ(answer_to("").status, 2);
  EXPECT_NE(answer_to("").text.find("conform"), std::string::npos);
  const test::ShellOutput verb = answer_to("confrom");
  EXPECT_EQ(verb.status, 2);
  EXPECT_EQ(verb.text, "decant: 'confrom' is no command; did you mean conform? (decant --help lists them)\n");
  const test::ShellOutput option = answer_to("conform --backnd brute");
  EXPECT_EQ(option.status, 2);
  EXPECT_EQ(option.text, "decant: conform: --backnd is no option; did you mean --backend? (decant conform --help)\n");
  for (const char* version : {"--version", "-V", "version"}) EXPECT_EQ(answer_to(version).status, 0) << version;
  EXPECT_EQ(answer_to("help conform").text, answer_to("conform --help").text);
  EXPECT_EQ(answer_to("help").text, answer_to("--help").text);
}

TEST(Command, FindsRecordingsByName) {
  EXPECT_EQ(answer_to("conform hostile-empty --backend hash --quiet").status, 0);
  EXPECT_EQ(answer_to("conform no-such-state --backend hash --quiet").status, 2);
  const test::ShellOutput mistyped = answer_to("conform hostile-emty --quiet");
  EXPECT_EQ(mistyped.status, 2);
  EXPECT_NE(mistyped.text.find("did you mean hostile-empty?"), std::string::npos) << mistyped.text;
  const test::ShellOutput list = answer_to("conform --list");
  EXPECT_NE(list.text.find("\nhostile-empty               wendland_c2, 0 particles, "), std::string::npos);
  EXPECT_NE(list.text.find("\npour-56k-stream             cubic_spline, 55596 particles, 89"), std::string::npos)
      << list.text;
  EXPECT_NE(list.text.find("at walls  (with --all)\n"), std::string::npos);
}

}  // namespace
}  // namespace decant
