/// \file
/// The Python that ci/setup makes, for tests of scripts and of what other programs read. No shell is between, so
/// that folders may have any name.
#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <string>
#include <vector>

extern char** environ;

namespace decant::test {

inline std::string python() { return DECANT_SOURCE_DIR "/build/venv/bin/python"; }

/// Exit status of a run with these arguments, -1 where there is none; its output goes to the test's.
/// \param quiet  what it says on standard error is dropped
inline int run_python(std::vector<std::string> arguments, bool quiet = false) {
  arguments.insert(arguments.begin(), {python(), "-B"});
  std::vector<char*> argv;
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (quiet) posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  pid_t pid = -1;
  const int failed = posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  if (failed != 0 || waitpid(pid, &status, 0) != pid) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Whether it is there and has these modules, comma-separated.
inline bool python_has(const std::string& modules) { return run_python({"-c", "import " + modules}, true) == 0; }

}  // namespace decant::test
