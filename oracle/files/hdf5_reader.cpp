/// \file
/// Reading: every claim of a file is checked before memory is asked for, because a fixture may come
/// from anywhere.
#include "oracle/files/hdf5_handle.hpp"
#include "oracle/files/hdf5_io.hpp"
#include "reference/error.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

namespace decant {
namespace {

// Below this a claim is harmless; above it, it must be credible for the bytes that are stored.
constexpr double free_claim = 64.0 * 1024 * 1024;
// Deflate shrinks by 1032 at most.
constexpr double largest_compression = 1100;

std::vector<hsize_t> extent_of(hid_t space) {
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> dims(static_cast<std::size_t>(std::max(rank, 0)));
  if (rank > 0) H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  return dims;
}

/// Refused everywhere: such strings lie in a heap that HDF5 1.10 walks for ever when it is damaged.
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

std::string kind_name(H5T_class_t kind) {
  return kind == H5T_FLOAT ? "reals" : kind == H5T_INTEGER ? "integers" : "fixed-length strings";
}

std::string trimmed(const char* raw, std::size_t size, H5T_str_t padding) {
  std::string text(raw, strnlen(raw, size));
  if (padding == H5T_STR_SPACEPAD) text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

/// Strings of a dataset or an attribute; `read` is H5Dread or H5Aread on it, `count` was checked.
template <typename Read>
bool read_strings(hid_t type, std::size_t count, const Read& read, std::vector<std::string>& out) {
  const std::size_t size = H5Tget_size(type);
  std::vector<char> raw(count * size);
  if (read(type, raw.data()) < 0) return false;
  out.reserve(count);
  for (std::size_t k = 0; k < count; ++k) out.push_back(trimmed(raw.data() + k * size, size, H5Tget_strpad(type)));
  return true;
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

struct Dataset {
  Handle id, type, space;
  std::vector<hsize_t> dims;
  std::size_t count = 1;
};

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
  std::error_code ignored;
  const std::uintmax_t file_size = std::filesystem::file_size(reader.file(), ignored);
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

  std::error_code ignored;
  const double file_size = static_cast<double>(std::filesystem::file_size(reader.file(), ignored));
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

/// Opens a dataset and holds it to class, rank, first extent (n >= 0) and, of vectors beyond rank 1, a
/// last extent of 3.
Dataset open_dataset(const Hdf5Reader& reader, hid_t file, const std::string& path, H5T_class_t kind, std::size_t rank,
                     std::int64_t n, bool vectors = true) {
  Handle object = open_object(reader, file, path);
  if (H5Iget_type(object.get()) != H5I_DATASET) reader.fail(path, "a group", "a dataset");
  Dataset data{std::move(object), Handle(-1), Handle(-1), {}};
  data.type = Handle(H5Dget_type(data.id.get()));
  data.space = Handle(H5Dget_space(data.id.get()));
  if (!data.type || !data.space) reader.fail(path, hdf5_message(), "readable");
  data.dims = extent_of(data.space.get());

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

struct Attribute {
  Handle id, type, space;
};

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

}  // namespace

Hdf5Reader::Hdf5Reader(std::filesystem::path file) : file_(std::move(file)) {
  silence_hdf5();
  const std::string expected = "an HDF5 file";
  std::error_code error;
  const auto status = std::filesystem::status(file_, error);
  if (!std::filesystem::exists(status)) fail("file", "not found", expected);
  if (!std::filesystem::is_regular_file(status))
    fail("file", std::filesystem::is_directory(status) ? "a folder" : "not a regular file", expected);
  if (std::filesystem::file_size(file_, error) == 0) fail("file", "empty", expected);

  const Handle access(H5Pcreate(H5P_FILE_ACCESS));
  // Other readers may have it open, and some network file systems have no locks.
  H5Pset_file_locking(access.get(), false, true);
  id_ = H5Fopen(file_.c_str(), H5F_ACC_RDONLY, access.get());
  if (id_ < 0) fail("file", hdf5_message(), "a whole HDF5 file");
  // HDF5 1.10 reads beyond what it holds where older, unchecked headers are damaged.
  H5F_info2_t info;
  if (H5Fget_info2(id_, &info) < 0 || info.super.version < 2) {
    H5Fclose(std::exchange(id_, -1));
    fail("file", "in HDF5's format without checksums", "of HDF5 1.8 or later (h5py: libver=\"v108\")");
  }
}

Hdf5Reader::~Hdf5Reader() {
  if (id_ >= 0) H5Fclose(id_);
}

void Hdf5Reader::fail(const std::string& key, const std::string& value, const std::string& bound) const {
  throw InputError(file_.string(), key, value, bound);
}

bool Hdf5Reader::has(const std::string& path) const { return exists(id_, path); }

std::vector<std::string> Hdf5Reader::children(const std::string& group) const {
  const Handle object = open_object(*this, id_, group);
  H5G_info_t info;
  if (H5Iget_type(object.get()) != H5I_GROUP || H5Gget_info(object.get(), &info) < 0)
    fail(group, "a dataset", "a group");
  std::vector<std::string> names;
  for (hsize_t k = 0; k < info.nlinks; ++k) {
    char name[256];
    if (H5Lget_name_by_idx(object.get(), ".", H5_INDEX_NAME, H5_ITER_INC, k, name, sizeof name, H5P_DEFAULT) < 0)
      fail(group, hdf5_message(), "readable; the file is damaged");
    names.emplace_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::int64_t> Hdf5Reader::shape(const std::string& path) const {
  const Handle object = open_object(*this, id_, path);
  if (H5Iget_type(object.get()) != H5I_DATASET) fail(path, "a group", "a dataset");
  const Handle space(H5Dget_space(object.get()));
  const auto dims = extent_of(space.get());
  return {dims.begin(), dims.end()};
}

bool Hdf5Reader::holds_integers(const std::string& path) const {
  const Handle object = open_object(*this, id_, path);
  if (H5Iget_type(object.get()) != H5I_DATASET) fail(path, "a group", "a dataset");
  return H5Tget_class(Handle(H5Dget_type(object.get())).get()) == H5T_INTEGER;
}

Eigen::VectorXd Hdf5Reader::vector(const std::string& path, std::int64_t n) const {
  const Dataset data = open_dataset(*this, id_, path, H5T_FLOAT, 1, n);
  Eigen::VectorXd values(static_cast<Eigen::Index>(data.count));
  read_all(*this, path, data, H5T_NATIVE_DOUBLE, values.data());
  return values;
}

Eigen::Matrix3Xd Hdf5Reader::matrix3(const std::string& path, std::int64_t n) const {
  const Dataset data = open_dataset(*this, id_, path, H5T_FLOAT, 2, n);
  Eigen::Matrix3Xd values(3, static_cast<Eigen::Index>(data.dims[0]));
  read_all(*this, path, data, H5T_NATIVE_DOUBLE, values.data());
  return values;
}

namespace {

/// Entry `index` of a [T,n] or [T,n,3] dataset, as columns of `values`.
template <class Matrix>
Matrix read_entry(const Hdf5Reader& reader, const std::string& path, const Dataset& data, std::int64_t index,
                  hid_t memory_type, Matrix values) {
  if (index < 0 || static_cast<hsize_t>(index) >= data.dims[0])
    reader.fail(path, describe(data.type.get(), data.dims), fmt::format("to hold entry {}", index));
  const auto rank = static_cast<int>(data.dims.size());
  values.resize(rank == 3 ? 3 : static_cast<Eigen::Index>(data.dims[1]),
                rank == 3 ? static_cast<Eigen::Index>(data.dims[1]) : 1);
  const hsize_t start[3] = {static_cast<hsize_t>(index), 0, 0}, count[3] = {1, data.dims[1], 3};
  const Handle memory(H5Screate_simple(rank, count, nullptr));
  H5Sselect_hyperslab(data.space.get(), H5S_SELECT_SET, start, nullptr, count, nullptr);
  if (values.size() > 0 &&
      H5Dread(data.id.get(), memory_type, memory.get(), data.space.get(), H5P_DEFAULT, values.data()) < 0)
    reader.fail(path, hdf5_message(), "readable; the file is damaged");
  return values;
}

}  // namespace

Eigen::Matrix3Xd Hdf5Reader::matrix3_at(const std::string& path, std::int64_t index) const {
  return read_entry(*this, path, open_dataset(*this, id_, path, H5T_FLOAT, 3, -1), index, H5T_NATIVE_DOUBLE,
                    Eigen::Matrix3Xd());
}

Eigen::VectorXd Hdf5Reader::vector_at(const std::string& path, std::int64_t index) const {
  return read_entry(*this, path, open_dataset(*this, id_, path, H5T_FLOAT, 2, -1, false), index, H5T_NATIVE_DOUBLE,
                    Eigen::VectorXd());
}

IdVector Hdf5Reader::integers_at(const std::string& path, std::int64_t index) const {
  return read_entry(*this, path, open_dataset(*this, id_, path, H5T_INTEGER, 2, -1, false), index, H5T_NATIVE_INT64,
                    IdVector());
}

IdVector Hdf5Reader::integers(const std::string& path, std::int64_t n) const {
  const Dataset data = open_dataset(*this, id_, path, H5T_INTEGER, 1, n);
  IdVector values(static_cast<Eigen::Index>(data.count));
  const bool wide = H5Tget_size(data.type.get()) >= 8 && H5Tget_sign(data.type.get()) == H5T_SGN_NONE;
  // HDF5 would clip what int64 does not hold; read as unsigned, such a value turns negative.
  read_all(*this, path, data, wide ? H5T_NATIVE_UINT64 : H5T_NATIVE_INT64, values.data());
  if (wide && values.size() > 0 && values.minCoeff() < 0)
    fail(path, std::to_string(static_cast<std::uint64_t>(values.minCoeff())), "at most 2^63 - 1");
  return values;
}

std::vector<std::string> Hdf5Reader::strings(const std::string& path, std::int64_t n) const {
  const Dataset data = open_dataset(*this, id_, path, H5T_STRING, 1, n);
  std::vector<std::string> values;
  const auto read = [&](hid_t type, void* out) {
    return data.count == 0 ? 0 : H5Dread(data.id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
  };
  if (!read_strings(data.type.get(), data.count, read, values))
    fail(path, hdf5_message(), "readable; the file is damaged");
  return values;
}

std::string Hdf5Reader::text(const std::string& path) const {
  const Dataset data = open_dataset(*this, id_, path, H5T_STRING, 0, -1);
  std::vector<std::string> values;
  const auto read = [&](hid_t type, void* out) {
    return H5Dread(data.id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
  };
  if (!read_strings(data.type.get(), 1, read, values)) fail(path, hdf5_message(), "readable; the file is damaged");
  return values.front();
}

std::vector<std::string> Hdf5Reader::attribute_names(const std::string& object) const {
  const Handle owner = open_object(*this, id_, object);
  std::vector<std::string> names;
  const auto take = [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  if (H5Aiterate2(owner.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, take, &names) < 0)
    fail(object, hdf5_message(), "readable attributes; the file is damaged");
  std::sort(names.begin(), names.end());
  return names;
}

bool Hdf5Reader::has_attribute(const std::string& object, const std::string& name) const {
  const Handle owner = open_object(*this, id_, object);
  return H5Aexists(owner.get(), name.c_str()) > 0;
}

std::string Hdf5Reader::text_attribute(const std::string& object, const std::string& name) const {
  const Attribute a =
      open_attribute(*this, id_, object, name, [](H5T_class_t c) { return c == H5T_STRING; }, "a fixed-length string");
  std::vector<std::string> values;
  const auto read = [&](hid_t type, void* out) { return H5Aread(a.id.get(), type, out); };
  if (!read_strings(a.type.get(), 1, read, values))
    fail(attribute_key(object, name), hdf5_message(), "readable; the file is damaged");
  return values.front();
}

double Hdf5Reader::real_attribute(const std::string& object, const std::string& name) const {
  const Attribute a = open_attribute(
      *this, id_, object, name, [](H5T_class_t c) { return c == H5T_FLOAT || c == H5T_INTEGER; }, "a real number");
  double value = std::numeric_limits<double>::quiet_NaN();
  if (H5Aread(a.id.get(), H5T_NATIVE_DOUBLE, &value) < 0)
    fail(attribute_key(object, name), hdf5_message(), "readable; the file is damaged");
  return value;
}

std::int64_t Hdf5Reader::integer_attribute(const std::string& object, const std::string& name) const {
  const Attribute a =
      open_attribute(*this, id_, object, name, [](H5T_class_t c) { return c == H5T_INTEGER; }, "an integer");
  std::int64_t value = 0;
  if (H5Aread(a.id.get(), H5T_NATIVE_INT64, &value) < 0)
    fail(attribute_key(object, name), hdf5_message(), "readable; the file is damaged");
  return value;
}

}  // namespace decant
