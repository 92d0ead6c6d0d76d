/// \file
/// How a user's mistake is reported: file, key, value and the allowed range, before any work.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace decant {

/// Bad scene, fixture or option. Ends the command with exit status 2.
class InputError : public std::runtime_error {
 public:
  /// \param file  the file, or the option, that is wrong; \param key  where in it ("fluid.viscosity");
  /// \param value  what stands there; \param bound  what is allowed.
  InputError(std::string file, std::string key, std::string value, std::string bound)
      : std::runtime_error(file + ": " + key + " = " + value + ": " + bound),
        file_(std::move(file)),
        key_(std::move(key)),
        value_(std::move(value)),
        bound_(std::move(bound)) {}

  const std::string& file() const { return file_; }
  const std::string& key() const { return key_; }
  const std::string& value() const { return value_; }
  const std::string& bound() const { return bound_; }

 private:
  std::string file_, key_, value_, bound_;
};

/// A backend or a device failed, or something asked for could not run. Exit status 3.
class BackendError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace decant
