/// \file
/// What has to be checked of a dataset or an attribute before it is read, because a file may come from anywhere: class,
/// shape, where its bytes lie, and whether so many can be there.
#pragma once

#include "oracle/files/hdf5_handle.hpp"
#include "oracle/files/hdf5_io.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace decant::hdf5 {

struct Dataset {
  Handle id, type, space;
  std::vector<hsize_t> dims;
  std::size_t count = 1;
};

struct Attribute {
  Handle id, type, space;
};

std::vector<hsize_t> extent_of(hid_t space);

/// Of variable length: such strings lie in a heap that HDF5 1.10 walks for ever when it is damaged.
bool is_variable_string(hid_t type);

/// "float32 [4,3]".
std::string describe(hid_t type, const std::vector<hsize_t>& dims);

/// "/a@b".
std::string attribute_key(const std::string& object, const std::string& name);

std::string trimmed(const char* raw, std::size_t size, H5T_str_t padding);

/// Fixed-length strings of a dataset or an attribute; `read` is H5Dread or H5Aread on it, `count` was checked.
template <typename Read>
bool read_strings(hid_t type, std::size_t count, const Read& read, std::vector<std::string>& out) {
  const std::size_t size = H5Tget_size(type);
  std::vector<char> raw(count * size);
  if (read(type, raw.data()) < 0) return false;
  out.reserve(count);
  for (std::size_t k = 0; k < count; ++k) out.push_back(trimmed(raw.data() + k * size, size, H5Tget_strpad(type)));
  return true;
}

/// Opens a group or dataset by hard links alone: a soft or external link could lead anywhere. These and all below throw
/// InputError by reader.fail.
Handle open_object(const Hdf5Reader& reader, hid_t file, const std::string& path);

/// What a dataset's shape has to be beyond its rank.
enum class Extents { any, vectors };

/// Opens a dataset and requires class, rank, first extent (n >= 0) and, of vectors beyond rank 1, a last extent of 3;
/// that its bytes lie in this file, all of them, and are credible for its size.
Dataset open_dataset(const Hdf5Reader& reader, hid_t file, const std::string& path, H5T_class_t kind, std::size_t rank,
                     std::int64_t n, Extents extents = Extents::vectors);

void read_all(const Hdf5Reader& reader, const std::string& path, const Dataset& data, hid_t memory, void* out);

/// Opens an attribute of one value. \param takes  which classes; \param expected  them in words
Attribute open_attribute(const Hdf5Reader& reader, hid_t file, const std::string& object, const std::string& name,
                         bool (*takes)(H5T_class_t), const std::string& expected);

}  // namespace decant::hdf5
