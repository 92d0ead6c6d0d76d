/// \file
/// The verbs of the `decant` command. Each adds its options to the app and runs when the app has
/// parsed its name; what it found out is left in the exit status.
#pragma once

#include <CLI/CLI.hpp>

namespace decant {

/// What the command's exit statuses mean.
enum ExitStatus : int {
  exit_pass = 0,
  exit_does_not_conform = 1,
  exit_bad_input = 2,
  exit_failure = 3,         // of a backend or a device, or something asked for could not run
  exit_device_absent = 77,  // CTest counts it as skipped
};

/// `decant pour`: runs a scene and writes frames, timeline and mass by place. Exit status 1 where
/// mass does not add up or a particle passed a wall; 130 or 143 where a signal stopped it.
void add_pour_command(CLI::App& app, int& exit_status);

/// `decant info`: version, build, executors, libraries.
void add_info_command(CLI::App& app, int& exit_status);

/// `decant conform`: the conformance suite.
void add_conform_command(CLI::App& app, int& exit_status);

/// `decant diff`: what changed between two reports, or where two pours part. Exit status 1 where a
/// verdict got worse, or pours differ by more than their spread.
void add_diff_command(CLI::App& app, int& exit_status);

/// `decant bench`: what a substep costs.
void add_bench_command(CLI::App& app, int& exit_status);

/// `decant export`: what a solver in another language needs of a fixture.
void add_export_command(CLI::App& app, int& exit_status);

/// `decant fuzz`: random problems, held to properties. Exit status 1 where one does not hold.
void add_fuzz_command(CLI::App& app, int& exit_status);

/// `decant drift`: what neighbor lists miss that are rebuilt every N substeps. Exit status 1 where
/// --recommend finds nothing.
void add_drift_command(CLI::App& app, int& exit_status);

/// `decant validate`: the solver against cases whose answer is known. Exit status 1 where a gate is not
/// met.
void add_validate_command(CLI::App& app, int& exit_status);

/// `decant live`: runs a scene that is looked at and changed in a browser. Ends with 130 or 143, by a signal.
void add_live_command(CLI::App& app, int& exit_status);

/// `decant record`: runs the oracle and writes a fixture.
void add_record_command(CLI::App& app, int& exit_status);

}  // namespace decant
