/// \file
/// What is made of ncu's table: figures, quotients, names; and what is said where there is no ncu. The table here is as
/// ncu 2025.3 prints it, with other numbers.
#include "tools/commands/profile.hpp"

#include "oracle/files/temporary_folder.hpp"
#include "tests/built_files.hpp"
#include "tests/shell_output.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

namespace decant {
namespace {

const std::string heading =
    R"csv("ID","Kernel Name","gpu__time_duration.sum","l1tex__t_sectors_pipe_lsu_mem_global_op_ld.sum",)csv"
    R"csv("l1tex__t_requests_pipe_lsu_mem_global_op_ld.sum","memory_l2_theoretical_sectors_global",)csv"
    R"csv("memory_l2_theoretical_sectors_global_ideal","smsp__average_warps_issue_stalled_wait_per_issue_active.ratio",)csv"
    R"csv("smsp__average_warps_issue_stalled_long_scoreboard_per_issue_active.ratio")csv";

std::string csv() {
  return "==PROF== Connected to process 7\n" + heading + "\n" + R"csv("","","ns","sector","","","","inst","inst")csv" +
         "\n" +
         R"csv("0","void decant::<unnamed>::density_kernel<decant::<unnamed>::TileTeam, (int)2>(int, float *)","1,000","8","2","100","90","1.5","nan")csv" +
         "\n" + R"csv("1","build(Lists)","500","6","0","0","0","0.5","2.5")csv" + "\n" +
         R"csv("2","void decant::<unnamed>::density_kernel<decant::<unnamed>::TileTeam, (int)2>(int, float *)","3,000","8","2","100","75","1.5","3.25")csv" +
         "\n==PROF== Disconnected\n";
}

double value(const profile::Kernel& kernel, const std::string& name) {
  for (std::size_t k = 0; k < profile::counters.size(); ++k)
    if (name == profile::counters[k].name) return kernel.values[k];
  throw std::runtime_error(name);
}

TEST(Profile, IsTheLastLaunchOfEachKernel) {
  const auto kernels = profile::kernels_in(csv());
  ASSERT_EQ(kernels.size(), 2U);
  EXPECT_EQ(kernels[0].name, "density_kernel<TileTeam, 2>");
  EXPECT_EQ(value(kernels[0], "time"), 3);
  EXPECT_EQ(value(kernels[0], "sectors_per_request"), 4);
  EXPECT_EQ(value(kernels[0], "excessive_sectors"), 25);
  EXPECT_EQ(value(kernels[0], "excessive_share"), 25);
  EXPECT_TRUE(std::isnan(value(kernels[0], "registers"))) << "ncu did not count them";
  EXPECT_EQ(kernels[0].largest_stall(), "long_scoreboard 3.2");
  EXPECT_EQ(kernels[1].name, "build");
  EXPECT_EQ(value(kernels[1], "sectors_per_request"), 0);
  const std::string table = profile::table(kernels);
  EXPECT_NE(table.find("density_kernel<TileTeam, 2>           3"), std::string::npos) << table;
  const std::string json = profile::json("a-state", "brute", kernels);
  EXPECT_NE(json.find("\"excessive_share\": 25.0"), std::string::npos) << json;
  EXPECT_EQ(json.find("registers"), std::string::npos) << "what was not counted is left out";
}

TEST(Profile, NamesKernelsWhateverNcuMakesOfUnnamedNamespaces) {
  const auto name = [](const std::string& raw) {
    return profile::kernels_in("\"ID\",\"Kernel Name\"\n\"0\",\"" + raw + "\"\n").at(0).name;
  };
  EXPECT_EQ(name("void unnamed>::density_kernel<unnamed>::TileTeam, unnamed>::BruteNeighbors<(bool)0>>(int)"),
            "density_kernel<TileTeam, BruteNeighbors<0>>");
  EXPECT_EQ(name("void decant::gpu::<unnamed>::force_kernel<<unnamed>::SubWarp<(int)8>, decant::<unnamed>::A>(int)"),
            "force_kernel<SubWarp<8>, A>");
  EXPECT_EQ(name("<unnamed>::build(float *)"), "build");
}

TEST(Profile, OfNoTableIsAnError) { EXPECT_THROW((void)profile::kernels_in("==ERROR== no\n"), BackendError); }

/// A program in ncu's place, and what the command says.
test::ShellOutput with_ncu(const std::string& script, const std::string& arguments) {
  const TemporaryFolder folder;
  const std::filesystem::path program = folder / "ncu";
  std::ofstream(program) << "#!/bin/sh\n" << script;
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  return test::shell_output("DECANT_NCU='" + program.string() + "' " + test::command() + " bench hostile-crowd " +
                            arguments + " --profile");
}

TEST(Profile, SaysWhatNcuSays) {
  const auto refused =
      with_ncu("echo '==PROF== Connected'; echo '==ERROR== ERR_NVGPUCTRPERM - no permission'; exit 1\n",
               "--backend brute --executor host");
  EXPECT_EQ(refused.status, 3);
  EXPECT_NE(refused.text.find("cannot profile brute: ==ERROR== ERR_NVGPUCTRPERM - no permission"), std::string::npos)
      << refused.text;
  const auto absent = test::shell_output("DECANT_NCU=/nowhere/ncu " + test::command() +
                                         " bench hostile-crowd --backend brute --executor host --profile");
  EXPECT_EQ(absent.status, 3);
  EXPECT_NE(absent.text.find("/nowhere/ncu"), std::string::npos) << absent.text;
  const auto none = with_ncu("echo '==WARNING== No kernels were profiled.'\n", "--backend brute --executor host");
  EXPECT_NE(none.text.find("launched no kernel"), std::string::npos) << none.text;
}

/// ncu's last arguments are this command on the recording: run here without ncu.
TEST(Profile, AsksNcuToRunTheCommandOnTheRecording) {
  const auto out =
      with_ncu("while [ \"$1\" != bench ]; do last=$1; shift; done; \"$last\" \"$@\" && echo 'ran: '\"$@\"\n",
               "--backend list:skin=0.1 --executor host");
  EXPECT_EQ(out.status, 3) << "no kernels";
  EXPECT_NE(out.text.find("ncu printed no table of kernels"), std::string::npos) << out.text;
  EXPECT_EQ(with_ncu("exit 0\n", "--substeps 3 --backend brute").status, 2);
}

}  // namespace
}  // namespace decant
