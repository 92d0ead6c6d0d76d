/// \file
/// The command's waiting threads sleep, unless its user says otherwise.
#include "tests/built_files.hpp"
#include "tests/shell_output.hpp"

#include <gtest/gtest.h>

#include <string>

namespace decant {
namespace {

std::string output_of(const std::string& command) { return test::shell_output(command).text; }

/// What the OpenMP runtime says that it does, the last time that it says so.
std::string policy_told(const std::string& settings) {
  const std::string text = output_of("env -u OMP_WAIT_POLICY -u GOMP_SPINCOUNT OMP_DISPLAY_ENV=verbose " + settings +
                                     " " + test::command() + " info");
  const auto at = text.rfind("OMP_WAIT_POLICY = '");
  if (at == std::string::npos) return "not told: " + text;
  const auto begin = at + std::string("OMP_WAIT_POLICY = '").size();
  return text.substr(begin, text.find('\'', begin) - begin);
}

TEST(WaitPolicy, OfTheCommandIsPassiveAndTheRuntimeKnowsIt) { EXPECT_EQ(policy_told(""), "PASSIVE"); }

TEST(WaitPolicy, IsLeftToAUserWhoSetsIt) {
  EXPECT_EQ(policy_told("OMP_WAIT_POLICY=active"), "ACTIVE");
  EXPECT_NE(output_of("env -u OMP_WAIT_POLICY GOMP_SPINCOUNT=1000 " + test::command() + " info")
                .find("OMP_WAIT_POLICY not set"),
            std::string::npos);
}

TEST(WaitPolicy, ComesWithTheSameArgumentsAndExitStatus) {
  EXPECT_NE(
      output_of("env -u OMP_WAIT_POLICY " + test::command() + " info --json").find("\"omp_wait_policy\": \"passive\""),
      std::string::npos);
  EXPECT_NE(output_of("env -u OMP_WAIT_POLICY " + test::command() + " pour /nowhere.json --out x; echo =$?").find("=2"),
            std::string::npos);
}

}  // namespace
}  // namespace decant
