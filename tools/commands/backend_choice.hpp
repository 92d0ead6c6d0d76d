/// \file
/// From --backend and --executor to a solver.
#pragma once

#include "oracle/backend.hpp"
#include "reference/error.hpp"

#include <CLI/CLI.hpp>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace decant {

/// The executor that was asked for has no device here. Exit status 77.
class DeviceAbsent : public BackendError {
 public:
  using BackendError::BackendError;
};

/// Options of backends as flags of their own: --rebuild 10 is list:rebuild=10 for every list chosen.
struct BackendFlags {
  std::map<std::string, std::string> given;  // key, value

  void add_to(CLI::App& verb);
  /// The choice with the flags that its backend knows; counts each use.
  std::string applied_to(const std::string& choice);
  /// Throws InputError where a flag was given that no chosen backend knows.
  void require_used() const;

 private:
  std::map<std::string, int> used_;
};

/// Of a solver that is built elsewhere, plugin:… or python:….
bool is_plugin(const std::string& choice);

/// Throws InputError naming what a plug-in does not offer of what a verb asks it for. \param choice  as on the command
/// line
void require_offers(const Backend& backend, const std::string& choice, const char* verb);

/// Whether a backend of that name there is, or it is a plug-in; a file's name is neither.
bool names_backend(const std::string& choice);

/// What --backend accepts: "reference" and the table of backends under test.
std::vector<std::string> backend_choices();

/// The backend of that choice: NAME or NAME:OPTIONS ("reference:all-pairs"), plugin:PATH, python:FILE:CLASS.
/// \param executor  "auto" (cuda where there is a device, else host),
/// "cuda" or "host"; the reference runs on the host only
/// Throws InputError for an unknown name, DeviceAbsent where the executor has no device.
std::unique_ptr<Backend> choose_backend(const std::string& choice, const std::string& executor);

}  // namespace decant
