/// \file
/// Recorded states judged with another kernel than their own: a port that has all kernels passes, one that has one does
/// not.
#include "oracle/checks/conform.hpp"
#include "oracle/files/fixture_file.hpp"
#include "tests/built_files.hpp"
#include "tests/edited_reference.hpp"
#include "tests/shell_output.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/common/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace decant {
namespace {

Fixture recorded(const std::string& name) { return read_fixture(DECANT_SOURCE_DIR "/fixtures/" + name + ".h5"); }

constexpr KernelFamily families[] = {KernelFamily::cubic_spline, KernelFamily::wendland_c2, KernelFamily::mueller2003};

bool passes(Backend& backend, const Fixture& fixture, const CheckSelection& checks) {
  const auto rows = run_checks(backend, fixture, prepare_reference(fixture, checks), checks);
  return std::ranges::none_of(rows, [](const CheckRow& row) { return row.verdict == Verdict::fail; });
}

TEST(KernelOption, EveryBackendConformsWithEveryKernelOnHost) {
  for (const std::string name : {"hostile-bowl", "hostile-periodic", "hostile-tilted-box"})
    for (const KernelFamily family : families) {
      const Fixture fixture = with_kernel(recorded(name), family);
      EXPECT_EQ(fixture.scene.kernel, family);
      for (const std::string choice : {"brute", "hash", "list"})
        EXPECT_TRUE(passes(*choose_backend(choice, "host"), fixture, all_checks())) << choice << ' ' << fixture.name;
    }
}

TEST(KernelOption, OneKernelIsNotEnough) {
  test::Edit edit;
  edit.loaded = [](Scene& scene, ParticleState&) { scene.kernel = KernelFamily::wendland_c2; };
  test::EditedReference port(edit);
  for (const KernelFamily family : families) {
    const Fixture fixture = with_kernel(recorded("hostile-crowd"), family);
    EXPECT_EQ(passes(port, fixture, {"fields"}), family == KernelFamily::wendland_c2) << fixture.name;
  }
}

TEST(KernelOption, LeavesARecordingWithThatKernelAsItIs) {
  const Fixture fixture = recorded("hostile-crowd"), same = with_kernel(fixture, fixture.scene.kernel);
  EXPECT_EQ(same.name, fixture.name);
  EXPECT_EQ(same.fields->density, fixture.fields->density);
  const Fixture other = with_kernel(fixture, KernelFamily::mueller2003);
  EXPECT_EQ(other.name, "hostile-crowd-mueller2003");
  EXPECT_NE(other.fields->density, fixture.fields->density);
}

TEST(KernelOption, IsRefusedByName) {
  const auto said = test::shell_output(test::command() + " conform hostile-crowd --kernel gauss");
  EXPECT_EQ(said.status, 2);
  EXPECT_NE(said.text.find("--kernel = gauss: one of cubic_spline, wendland_c2, mueller2003"), std::string::npos)
      << said.text;
}

}  // namespace
}  // namespace decant
