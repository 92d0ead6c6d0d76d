/// \file
/// Children that are forked and say what they have to by a pipe. One that hangs holds up no other.
#include "tests/faults/processes.hpp"

#include <poll.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <iostream>
#include <stdexcept>

namespace decant {
namespace {

struct Child {
  pid_t pid;
  int from;
  std::size_t k;
};

/// In the child. No destructors: a broken backend may not survive its own.
[[noreturn]] void say_into(int to, std::size_t k, const std::function<std::string(std::size_t)>& say) {
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
    // Of the processor's time, so that a busy machine makes no hang of a slow run; one that sleeps for good ends too.
    const itimerval limit{{0, 0}, {static_cast<time_t>(seconds), 0}};
    setitimer(ITIMER_PROF, &limit, nullptr);
    alarm(20 * seconds);
    say_into(ends[1], k, say);
  }
  close(ends[1]);
  return {pid, ends[0], k};
}

/// "": well.
std::string end_of(const Child& child) {
  close(child.from);
  int status = 0;
  waitpid(child.pid, &status, 0);
  if (WIFSIGNALED(status)) return WTERMSIG(status) == SIGALRM || WTERMSIG(status) == SIGPROF ? "hang" : "crash";
  return WEXITSTATUS(status) == 0 ? "" : "failed";
}

/// Those that have something to say, or have ended.
std::vector<Child> heard_from(const std::vector<Child>& running) {
  std::vector<pollfd> ends;
  for (const Child& child : running) ends.push_back({child.from, POLLIN, 0});
  if (poll(ends.data(), ends.size(), -1) < 0) throw std::runtime_error("no answer");
  std::vector<Child> heard;
  for (std::size_t i = 0; i < ends.size(); ++i)
    if (ends[i].revents != 0) heard.push_back(running[i]);
  return heard;
}

}  // namespace

std::vector<Said> in_processes(std::size_t count, int jobs, unsigned seconds,
                               const std::function<std::string(std::size_t)>& say) {
  std::vector<Said> all(count);
  std::vector<Child> running;
  for (std::size_t next = 0; next < count || !running.empty();) {
    for (; next < count && running.size() < static_cast<std::size_t>(jobs); ++next)
      running.push_back(begin(next, seconds, say));
    for (const Child& child : heard_from(running)) {
      char buffer[4096];
      const ssize_t n = read(child.from, buffer, sizeof buffer);
      if (n > 0) {
        all[child.k].text.append(buffer, static_cast<std::size_t>(n));
        continue;
      }
      all[child.k].ended = end_of(child);
      std::erase_if(running, [&](const Child& other) { return other.k == child.k; });
    }
  }
  return all;
}

std::unique_ptr<Backend> backend_of(const std::string& choice, Executor executor) {
  const auto colon = choice.find(':');
  return make_backend(choice.substr(0, colon), executor, colon == std::string::npos ? "" : choice.substr(colon + 1));
}

}  // namespace decant
