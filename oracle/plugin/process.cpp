/// \file
/// Starts and ends it; what it prints goes where this process prints.
#include "oracle/plugin/process.hpp"

#include "reference/error.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

extern char** environ;

namespace decant::plugin {
namespace {

constexpr int socket_there = 3;
constexpr unsigned wait_us = 5000;

}  // namespace

Process::Process(const std::string& program, const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw BackendError(fmt::format("{}: no socket: {}", program, std::strerror(errno)));
  std::vector<char*> words{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], socket_there);
  const int error = ::posix_spawnp(&id_, program.c_str(), &actions, nullptr, words.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  socket_ = ends[0];
  if (error == 0) return;
  ::close(socket_);
  throw BackendError(fmt::format("{}: {}", program, std::strerror(error)));
}

Process::~Process() {
  // Told that nobody asks any more it ends by itself, which checkers of memory need to say what they found.
  ::shutdown(socket_, SHUT_RDWR);
  for (int wait = 0; id_ > 0 && wait < 1000; ++wait) {
    siginfo_t ended{};
    if (::waitid(P_PID, static_cast<id_t>(id_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid != 0) break;
    ::usleep(wait_us);
  }
  end();
  ::close(socket_);
}

std::string Process::end() {
  if (id_ <= 0) return "has ended";
  // What is about to end by itself says how.
  int status = 0;
  pid_t ended = 0;
  for (int wait = 0; wait < 20 && (ended = ::waitpid(id_, &status, WNOHANG)) == 0; ++wait) ::usleep(wait_us);
  if (ended == 0) {
    ::kill(id_, SIGKILL);
    ::waitpid(id_, &status, 0);
    id_ = -1;
    return "was ended";
  }
  id_ = -1;
  if (WIFSIGNALED(status))
    return fmt::format("was ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
  return fmt::format("left with exit status {}", WEXITSTATUS(status));
}

void Process::kill() {
  if (id_ > 0) ::kill(id_, SIGKILL);
}

}  // namespace decant::plugin
