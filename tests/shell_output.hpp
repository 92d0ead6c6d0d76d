/// \file
/// What commands say to whoever types them.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace decant::test {

struct ShellOutput {
  int status = -1;   // exit status; -1: ended otherwise
  std::string text;  // errors included
};

inline ShellOutput shell_output(const std::string& command) {
  ShellOutput out;
  std::FILE* pipe = ::popen(("{ " + command + "; } 2>&1").c_str(), "r");
  if (!pipe) return out;
  std::array<char, 4096> part;
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), pipe)) out.text.append(part.data(), size);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) out.status = WEXITSTATUS(status);
  return out;
}

}  // namespace decant::test
