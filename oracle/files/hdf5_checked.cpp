/// \file
/// Checks of datasets and attributes: every claim of a file before memory is asked for.
#include "oracle/files/hdf5_checked.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace decant::hdf5 {
namespace {

// Below this a claim is harmless; above it, it must be credible for the bytes that are stored.
constexpr double free_claim = 64.0 * 1024 * 1024;
// Deflate shrinks by 1032 at most.
constexpr double largest_compression = 1100;

std::string kind_name(H5T_class_t kind) {
  return kind == H5T_FLOAT ? "reals" : kind == H5T_INTEGER ? "integers" : "fixed-length strings";
}

bool shuffled_and_deflated(hid_t plist) {
  for (int k = 0; k < H5Pget_nfilters(plist); ++k) {
    unsigned flags = 0, settings = 0;
    std::size_t values = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(plist, static_cast<unsigned>(k), &flags, &values, nullptr, 0, nullptr, &settings);
    if (filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_DEFLATE) return false;
  }
  return true;
}

/// Inflates every chunk: HDF5 1.10 takes what comes out for a whole chunk and reads on behind a
/// shorter one.
void check_chunks(const Hdf5Reader& reader, const std::string& path, const Dataset& data, hid_t plist, hsize_t chunks,
                  std::size_t chunk_bytes) {
  if (!shuffled_and_deflated(plist)) reader.fail(path, "another filter", "shuffle and deflate");
  const std::uintmax_t file_size = reader.file_size();
  std::vector<Bytef> stored, inflated(chunk_bytes);
  std::vector<hsize_t> offset(data.dims.size());
  for (hsize_t k = 0; k < chunks; ++k) {
    unsigned skipped_filters = 0;
    haddr_t address = 0;
    hsize_t size = 0;
    uLongf produced = inflated.size();
    bool whole =
        H5Dget_chunk_info(data.id.get(), data.space.get(), k, offset.data(), &skipped_filters, &address, &size) >= 0 &&
        skipped_filters == 0 && size <= file_size;
    if (whole) {
      stored.resize(size);
      std::uint32_t mask = 0;
      whole = H5Dread_chunk(data.id.get(), H5P_DEFAULT, offset.data(), &mask, stored.data()) >= 0 &&
              uncompress(inflated.data(), &produced, stored.data(), stored.size()) == Z_OK && produced == chunk_bytes;
    }
    if (!whole) reader.fail(path, fmt::format("chunk {} of {}", k, chunks), "whole; the file is damaged");
  }
}

/// The dataset's bytes must lie in this file, all of them, and be credible for its size.
void check_storage(const Hdf5Reader& reader, const std::string& path, const Dataset& data) {
  const Handle plist(H5Dget_create_plist(data.id.get()));
  const H5D_layout_t layout = H5Pget_layout(plist.get());
  if (layout == H5D_VIRTUAL || H5Pget_external_count(plist.get()) > 0)
    reader.fail(path, "stored in another file", "stored in this file");
  double claimed = static_cast<double>(H5Tget_size(data.type.get()));
  for (const hsize_t n : data.dims) claimed *= static_cast<double>(n);
  if (claimed == 0) return;

  const auto file_size = static_cast<double>(reader.file_size());
  double held = std::min(file_size, static_cast<double>(H5Dget_storage_size(data.id.get())));
  if (layout == H5D_CHUNKED) held *= largest_compression;
  const bool never_written = held == 0;
  if (never_written || !(claimed <= std::max(held, layout == H5D_CHUNKED ? free_claim : 0)))
    reader.fail(path, describe(data.type.get(), data.dims),
                fmt::format("its values in the file; {} bytes are there", H5Dget_storage_size(data.id.get())));
  if (layout != H5D_CHUNKED) return;

  std::vector<hsize_t> chunk(data.dims.size());
  H5Pget_chunk(plist.get(), static_cast<int>(chunk.size()), chunk.data());
  double expected = 1, chunk_bytes = static_cast<double>(H5Tget_size(data.type.get()));
  for (std::size_t k = 0; k < chunk.size(); ++k) {
    const hsize_t along_axis = (data.dims[k] + chunk[k] - 1) / chunk[k];
    expected *= static_cast<double>(along_axis);
    chunk_bytes *= static_cast<double>(chunk[k]);
  }
  hsize_t chunks = 0;
  H5Dget_num_chunks(data.id.get(), data.space.get(), &chunks);
  if (!(static_cast<double>(chunks) >= expected))
    reader.fail(path, fmt::format("{} chunks", chunks), fmt::format("{:.0f} chunks", expected));
  if (!(chunk_bytes <= std::max(claimed, free_claim)))
    reader.fail(path, fmt::format("chunks of {:.0f} bytes", chunk_bytes), "chunks no larger than the dataset");
  if (H5Pget_nfilters(plist.get()) > 0)
    check_chunks(reader, path, data, plist.get(), chunks, static_cast<std::size_t>(chunk_bytes));
}

}  // namespace

std::vector<hsize_t> extent_of(hid_t space) {
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> dims(static_cast<std::size_t>(std::max(rank, 0)));
  if (rank > 0) H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  return dims;
}

bool is_variable_string(hid_t type) { return H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) > 0; }

std::string describe(hid_t type, const std::vector<hsize_t>& dims) {
  std::string kind;
  const std::size_t bits = 8 * H5Tget_size(type);
  switch (H5Tget_class(type)) {
    case H5T_FLOAT:
      kind = fmt::format("float{}", bits);
      break;
    case H5T_INTEGER:
      kind = fmt::format("{}int{}", H5Tget_sign(type) == H5T_SGN_NONE ? "u" : "", bits);
      break;
    case H5T_STRING:
      kind = is_variable_string(type) ? "variable-length string" : "string";
      break;
    default:
      kind = "another type";
  }
  return dims.empty() ? kind + " scalar" : fmt::format("{} [{}]", kind, fmt::join(dims, ","));
}

std::string trimmed(const char* raw, std::size_t size, H5T_str_t padding) {
  std::string text(raw, strnlen(raw, size));
  if (padding == H5T_STR_SPACEPAD) text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

/// Opens a group or dataset by hard links alone: a soft or external link could lead anywhere.
Handle open_object(const Hdf5Reader& reader, hid_t file, const std::string& path) {
  for (std::size_t end = 0; end != std::string::npos && path != "/";) {
    end = path.find('/', end + 1);
    const std::string part = path.substr(0, end);
    if (!(H5Lexists(file, part.c_str(), H5P_DEFAULT) > 0)) reader.fail(path, "missing", "required");
    H5L_info_t link;
    if (H5Lget_info(file, part.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD)
      reader.fail(path, "a link", "a group or dataset of this file");
  }
  Handle object(H5Oopen(file, path.c_str(), H5P_DEFAULT));
  if (!object) reader.fail(path, hdf5_message(), "readable");
  return object;
}

Dataset open_dataset(const Hdf5Reader& reader, hid_t file, const std::string& path, H5T_class_t kind, std::size_t rank,
                     std::int64_t n, Extents extents) {
  Handle object = open_object(reader, file, path);
  if (H5Iget_type(object.get()) != H5I_DATASET) reader.fail(path, "a group", "a dataset");
  Dataset data{std::move(object), Handle(-1), Handle(-1), {}};
  data.type = Handle(H5Dget_type(data.id.get()));
  data.space = Handle(H5Dget_space(data.id.get()));
  if (!data.type || !data.space) reader.fail(path, hdf5_message(), "readable");
  data.dims = extent_of(data.space.get());

  const bool vectors = extents == Extents::vectors;
  const bool fits = H5Tget_class(data.type.get()) == kind && !is_variable_string(data.type.get()) &&
                    data.dims.size() == rank && H5Sget_simple_extent_type(data.space.get()) != H5S_NULL &&
                    (rank < 1 || n < 0 || data.dims[0] == static_cast<hsize_t>(n)) &&
                    (rank < 2 || !vectors || data.dims.back() == 3);
  if (!fits) {
    const std::string first = n < 0 ? "N" : std::to_string(n);
    reader.fail(path, describe(data.type.get(), data.dims),
                kind_name(kind) + (rank == 0   ? " scalar"
                                   : rank == 1 ? fmt::format(" [{}]", first)
                                   : !vectors  ? fmt::format(" [{},N]", first)
                                   : rank == 2 ? fmt::format(" [{},3]", first)
                                               : fmt::format(" [{},N,3]", first)));
  }
  check_storage(reader, path, data);
  for (const hsize_t extent : data.dims) data.count *= static_cast<std::size_t>(extent);
  return data;
}

void read_all(const Hdf5Reader& reader, const std::string& path, const Dataset& data, hid_t memory, void* out) {
  if (data.count == 0) return;
  if (H5Dread(data.id.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, out) < 0)
    reader.fail(path, hdf5_message(), "readable; the file is damaged");
}

std::string attribute_key(const std::string& object, const std::string& name) { return object + "@" + name; }

Attribute open_attribute(const Hdf5Reader& reader, hid_t file, const std::string& object, const std::string& name,
                         bool (*takes)(H5T_class_t), const std::string& expected) {
  const std::string key = attribute_key(object, name);
  const Handle owner = open_object(reader, file, object);
  if (!(H5Aexists(owner.get(), name.c_str()) > 0)) reader.fail(key, "missing", expected);
  Attribute a{Handle(H5Aopen(owner.get(), name.c_str(), H5P_DEFAULT)), Handle(-1), Handle(-1)};
  if (!a.id) reader.fail(key, hdf5_message(), "readable; the file is damaged");
  a.type = Handle(H5Aget_type(a.id.get()));
  a.space = Handle(H5Aget_space(a.id.get()));
  if (!a.type || !a.space) reader.fail(key, hdf5_message(), "readable; the file is damaged");
  if (!takes(H5Tget_class(a.type.get())) || is_variable_string(a.type.get()) ||
      H5Sget_simple_extent_npoints(a.space.get()) != 1)
    reader.fail(key, describe(a.type.get(), extent_of(a.space.get())), expected);
  return a;
}

}  // namespace decant::hdf5
