/// \file
/// What the two halves of hdf5_io share: identifiers that close themselves, and HDF5's own words.
#pragma once

#include <string>
#include <utility>

#include <hdf5.h>

namespace decant {

/// Owner of one HDF5 identifier of any kind; negative where opening failed.
class Handle {
 public:
  explicit Handle(hid_t id) : id_(id) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Handle() {
    if (id_ >= 0) H5Idec_ref(id_);
  }
  hid_t get() const { return id_; }
  explicit operator bool() const { return id_ >= 0; }

 private:
  hid_t id_;
};

/// Stops HDF5 from printing its error stack; per thread, so every opening asks for it.
inline void silence_hdf5() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

/// Innermost message of the last failing call, in HDF5's words.
inline std::string hdf5_message() {
  std::string message = "unknown HDF5 error";
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned n, const H5E_error2_t* error, void* out) -> herr_t {
        if (n == 0 && error->desc) *static_cast<std::string*>(out) = error->desc;
        return 0;
      },
      &message);
  return message;
}

/// "/a/b" of "/a/b/c"; "/" of "/c".
inline std::string parent_path(const std::string& path) {
  const auto slash = path.find_last_of('/');
  return slash == std::string::npos || slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace decant
