/// \file
/// What everything that calls HDF5 shares: identifiers that close themselves, HDF5's own words, and how groups,
/// datasets, attributes and files are made.
#pragma once

#include <string>
#include <utility>
#include <vector>

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
  hid_t release() { return std::exchange(id_, -1); }
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

/// Whether a path's links are all there.
inline bool exists(hid_t file, const std::string& path) {
  for (std::size_t end = 0; end != std::string::npos && path != "/";) {
    end = path.find('/', end + 1);
    if (!(H5Lexists(file, path.substr(0, end).c_str(), H5P_DEFAULT) > 0)) return false;
  }
  return true;
}

/// Makes a group and those above it where they are missing; false where HDF5 refuses. No time of
/// writing is kept, so that equal content is equal bytes.
inline bool make_group(hid_t file, const std::string& path) {
  const Handle creation(H5Pcreate(H5P_GROUP_CREATE));
  H5Pset_obj_track_times(creation.get(), false);
  for (std::size_t end = 0; end != std::string::npos && path != "/";) {
    end = path.find('/', end + 1);
    const std::string part = path.substr(0, end);
    if (!exists(file, part) && !Handle(H5Gcreate2(file, part.c_str(), H5P_DEFAULT, creation.get(), H5P_DEFAULT)))
      return false;
  }
  return true;
}

/// Dataspace of that shape; a scalar's where it has no axis.
inline Handle space_of(const std::vector<hsize_t>& shape) {
  return Handle(shape.empty() ? H5Screate(H5S_SCALAR)
                              : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr));
}

/// Fixed-length UTF-8 of `size` bytes. \param padding  what stands after a shorter text
inline Handle utf8_type(std::size_t size, H5T_str_t padding = H5T_STR_NULLPAD) {
  Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), size);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  H5Tset_strpad(type.get(), padding);
  return type;
}

/// Makes a dataset, and groups above it where they are missing, and writes no value; an empty handle where HDF5
/// refuses. No time of writing is kept.
/// \param creation  a dataset creation list, which this sets up further
inline Handle make_dataset(hid_t file, const std::string& path, hid_t type, const std::vector<hsize_t>& shape,
                           const Handle& creation) {
  H5Pset_obj_track_times(creation.get(), false);
  if (!make_group(file, parent_path(path))) return Handle(-1);
  return Handle(H5Dcreate2(file, path.c_str(), type, space_of(shape).get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT));
}

/// Writes one attribute of what stands at a path; false where HDF5 refuses.
/// \param shape  as of space_of
inline bool write_attribute(hid_t file, const std::string& object, const std::string& name, hid_t type, hid_t memory,
                            const void* value, const std::vector<hsize_t>& shape = {}) {
  const Handle owner(H5Oopen(file, object.c_str(), H5P_DEFAULT));
  if (!owner) return false;
  const Handle attribute(H5Acreate2(owner.get(), name.c_str(), type, space_of(shape).get(), H5P_DEFAULT, H5P_DEFAULT));
  return attribute && H5Awrite(attribute.get(), memory, value) >= 0;
}

/// Creates a file in the format of HDF5 1.8, the first whose object headers carry checksums (later
/// ones mark the file as open, which an image of it would keep).
/// \param access  a file access list, which this sets up further
inline Handle create_file(const std::string& file, const Handle& access) {
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V18, H5F_LIBVER_V18);
  const Handle creation(H5Pcreate(H5P_FILE_CREATE));
  H5Pset_obj_track_times(creation.get(), false);
  return Handle(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, creation.get(), access.get()));
}

}  // namespace decant
