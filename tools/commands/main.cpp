/// \file
/// The `decant` command: finds the verb, runs it, and turns what went wrong into one line and an
/// exit status.
#include "gpu/backends.hpp"
#include "reference/error.hpp"
#include "tools/commands/backend_choice.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/help_text.hpp"
#include "tools/commands/wait_policy.hpp"
#include "tools/common/build_provenance.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

namespace {

constexpr const char* footer =
    "Examples:\n"
    "  decant pour fixtures/scenes/pour-4k.json --out build/pour-4k\n"
    "  decant live fixtures/scenes/pour-4k.json\n"
    "  decant conform --backend brute --report build/report.h5\n"
    "  decant diff before.h5 build/report.h5\n"
    "  decant record fixtures/scenes/pour-4k.json --out pour-4k-stream.h5\n"
    "  decant validate --quick\n"
    "  decant info\n"
    "\n"
    "Exit status: 0 pass, 1 does not conform, 2 bad input, 3 backend or device failure,\n"
    "77 the device asked for is absent, 128 + n stopped by signal n.";

int complain(int status, const char* what) {
  fmt::print(stderr, "decant: {}\n", what);
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace decant;
  let_waiting_threads_sleep(argv);
  int status = exit_pass;
  std::vector<std::string> arguments(argv + 1, argv + argc);
  // As other programs have it.
  if (!arguments.empty() && arguments.front() == "version") arguments.front() = "--version";
  if (!arguments.empty() && arguments.front() == "help") {
    arguments.erase(arguments.begin());
    arguments.resize(std::min<std::size_t>(arguments.size(), 1));
    arguments.push_back("--help");
  }
  CLI::App app{"Judges GPU ports of an SPH fluid solver against a sequential oracle.", "decant"};
  app.formatter(std::make_shared<HelpText>());
  app.set_version_flag("-V,--version", "decant " + build_provenance().at("version"));
  app.require_subcommand(1);
  app.footer(footer);
  add_pour_command(app, status);
  add_live_command(app, status);
  add_record_command(app, status);
  add_conform_command(app, status);
  add_export_command(app, status);
  add_diff_command(app, status);
  add_bench_command(app, status);
  add_fuzz_command(app, status);
  add_drift_command(app, status);
  add_validate_command(app, status);
  add_info_command(app, status);
  if (arguments.empty()) {
    fmt::print(stderr, "{}", app.help());
    return exit_bad_input;
  }
  try {
    ProcessRanks ranks;
    if (ranks.serve()) return exit_pass;
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    return status;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    return complain(exit_bad_input, explained(app, error, arguments).c_str());
  } catch (const InputError& error) {
    return complain(exit_bad_input, error.what());
  } catch (const DeviceAbsent& error) {
    return complain(exit_device_absent, error.what());
  } catch (const std::exception& error) {
    return complain(exit_failure, error.what());
  }
}
