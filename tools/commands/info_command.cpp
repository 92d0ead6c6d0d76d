/// \file
/// `decant info`: what this build is and what this machine offers it.
#include "gpu/backends.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/common/build_provenance.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hdf5.h>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <memory>
#include <string>

namespace decant {
namespace {

std::string hdf5_version() {
  unsigned major = 0, minor = 0, release = 0;
  H5get_libversion(&major, &minor, &release);
  return fmt::format("{}.{}.{}", major, minor, release);
}

nlohmann::ordered_json executor_info(const char* name, Executor executor) {
  std::string why_not;
  const bool available = executor_available(executor, &why_not);
  nlohmann::ordered_json info = {{"name", name}, {"available", available}};
  if (available) info["device"] = executor_device(executor);
  else info["why_not"] = why_not;
  return info;
}

/// What OpenMP's threads do while they wait, as far as it is told.
std::string wait_policy() {
  const char* policy = std::getenv("OMP_WAIT_POLICY");
  return policy ? policy : "not set";
}

nlohmann::ordered_json collect() {
  const auto build = build_provenance();
  return {
      {"version", build.at("version")},
      {"git_revision", build.at("git_revision")},
      {"build_type", build.at("build_type")},
      {"compiler", build.at("compiler")},
      {"flags", build.at("flags")},
      {"backends", backend_choices()},
      {"omp_wait_policy", wait_policy()},
      {"executors",
       nlohmann::ordered_json::array({executor_info("host", Executor::host), executor_info("cuda", Executor::cuda)})},
      {"libraries",
       {{"Thrust", thrust_version()},
        {"MPI", mpi_version()},
        {"NCCL", nccl_version()},
        {"HDF5", hdf5_version()},
        {"Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
        {"fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100)},
        {"nlohmann_json", fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                                      NLOHMANN_JSON_VERSION_PATCH)},
        {"CLI11", CLI11_VERSION}}},
  };
}

void print(const nlohmann::ordered_json& info) {
  const auto text = [&](const char* key) { return info.at(key).get<std::string>(); };
  fmt::print("decant {} ({})\n", text("version"), text("git_revision"));
  fmt::print("build      {}, {}, {}\n", text("build_type"), text("compiler"), text("flags"));
  fmt::print("backends   {}\n", fmt::join(info.at("backends").get<std::vector<std::string>>(), ", "));
  for (const auto& executor : info.at("executors"))
    fmt::print("executor   {:<5} {}\n", executor.at("name").get<std::string>(),
               executor.at("available").get<bool>() ? executor.at("device").get<std::string>()
                                                    : "not available: " + executor.at("why_not").get<std::string>());
  fmt::print("threads    OMP_WAIT_POLICY {}\n", text("omp_wait_policy"));
  std::string libraries;
  for (const auto& [name, number] : info.at("libraries").items())
    libraries += fmt::format("{}{} {}", libraries.empty() ? "" : ", ", name, number.get<std::string>());
  fmt::print("libraries  {}\n", libraries);
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand("info", "version, build, executors and libraries");
  auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "Print JSON");
  command->footer("Example:\n  decant info --json");
  command->callback([as_json, &exit_status] {
    const auto info = collect();
    if (*as_json) fmt::print("{}\n", info.dump(2));
    else print(info);
    exit_status = exit_pass;
  });
}

}  // namespace decant
