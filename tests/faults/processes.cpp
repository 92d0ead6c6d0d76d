/// \file
/// Children that are forked, say what they have to by a pipe, and are waited for in order.
#include "tests/faults/processes.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <deque>
#include <iostream>
#include <stdexcept>

namespace decant {
namespace {

struct Child {
  pid_t pid;
  int from;
};

/// In the child. No destructors: a broken backend may not survive its own.
[[noreturn]] void say_into(int to, std::size_t k,
                           const std::function<std::string(std::size_t)>& say) {
  try {
    const std::string text = say(k);
    for (std::size_t at = 0; at < text.size();) {
      const ssize_t written = write(to, text.data() + at, text.size() - at);
      if (written <= 0) _exit(4);
      at += static_cast<std::size_t>(written);
    }
  } catch (const std::exception& error) {
    std::cerr << k << ": " << error.what() << '\n';
    _exit(5);
  }
  _exit(0);
}

Child begin(std::size_t k, unsigned seconds, const std::function<std::string(std::size_t)>& say) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t pid = fork();
  if (pid < 0) throw std::runtime_error("no process");
  if (pid == 0) {
    close(ends[0]);
    alarm(seconds);
    say_into(ends[1], k, say);
  }
  close(ends[1]);
  return {pid, ends[0]};
}

Said end(const Child& child) {
  Said said;
  char buffer[4096];
  for (ssize_t n; (n = read(child.from, buffer, sizeof buffer)) > 0;)
    said.text.append(buffer, static_cast<std::size_t>(n));
  close(child.from);
  int status = 0;
  waitpid(child.pid, &status, 0);
  if (WIFSIGNALED(status))
    said.ended = WTERMSIG(status) == SIGALRM ? "hang" : "crash";
  else if (WEXITSTATUS(status) != 0)
    said.ended = "failed";
  return said;
}

}  // namespace

std::vector<Said> in_processes(std::size_t count, int jobs, unsigned seconds,
                               const std::function<std::string(std::size_t)>& say) {
  std::vector<Said> all;
  std::deque<Child> running;
  for (std::size_t next = 0; all.size() < count;) {
    for (; next < count && running.size() < static_cast<std::size_t>(jobs); ++next)
      running.push_back(begin(next, seconds, say));
    all.push_back(end(running.front()));
    running.pop_front();
  }
  return all;
}

std::unique_ptr<Backend> backend_of(const std::string& choice, Executor executor) {
  const auto colon = choice.find(':');
  return make_backend(choice.substr(0, colon), executor,
                      colon == std::string::npos ? "" : choice.substr(colon + 1));
}

}  // namespace decant
