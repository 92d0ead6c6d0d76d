/// \file
/// `decant export`: what a solver in another language needs to compute a fixture's fields.
#include "oracle/files/fixture_file.hpp"
#include "oracle/files/port_inputs.hpp"
#include "tools/commands/commands.hpp"
#include "tools/commands/fixture_folder.hpp"
#include "tools/commands/output_place.hpp"

#include <fmt/format.h>

#include <memory>
#include <string>

namespace decant {
namespace {

struct ExportArguments {
  std::string fixture, out;
};

constexpr const char* export_footer =
    "Writes the state, the scene's constants, wall particles as they stand and move, and inputs of\n"
    "the staged accelerations; the layout is in oracle/formats/results.md.\n"
    "\n"
    "Example:\n"
    "  decant export fixtures/pour-4k-stream.h5 --out inputs.h5\n"
    "  build/venv/bin/python tools/python/numpy_port.py inputs.h5 --out theirs.h5\n"
    "  decant conform fixtures/pour-4k-stream.h5 --results theirs.h5";

int export_inputs(const ExportArguments& arguments) {
  check_output_place("--out", arguments.out);
  const Fixture fixture = read_fixture(recording_called(arguments.fixture));
  const auto oracle = std::make_unique<const PreparedReference>(prepare_reference(fixture, {}, 0, Staged::as_computed));
  write_port_inputs(arguments.out, fixture, *oracle);
  fmt::print("{}: {} particles, {} wall particles of {}\n", arguments.out, fixture.state.size(), oracle->walls.size(),
             fixture.name);
  return exit_pass;
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_status) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* verb = app.add_subcommand("export", "write what a foreign port needs of a fixture");
  verb->footer(export_footer);
  verb->add_option("FIXTURE", arguments->fixture, "recording (*.h5)")->required();
  verb->add_option("--out", arguments->out, "file to write")->required();
  verb->callback([arguments, &exit_status] { exit_status = export_inputs(*arguments); });
}

}  // namespace decant
