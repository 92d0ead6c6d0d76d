/// \file
/// A process beside this one, and a socket to it.
#pragma once

#include <sys/types.h>
#include <string>
#include <vector>

namespace decant::plugin {

/// Killed with its object.
class Process {
 public:
  /// \param program  a file, or a name on the PATH; its end of the socket is its descriptor 3. Throws BackendError
  Process(const std::string& program, const std::vector<std::string>& arguments);
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process();

  int socket() const { return socket_; }
  /// Kills it if it still runs; "was ended by signal 11 (Segmentation fault)".
  std::string end();
  void kill();

 private:
  pid_t id_ = -1;
  int socket_ = -1;
};

}  // namespace decant::plugin
