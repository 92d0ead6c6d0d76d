/// \file
/// Reading: what is there, and its values.
#include "oracle/files/hdf5_checked.hpp"
#include "reference/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace decant {

Hdf5Reader::Hdf5Reader(std::filesystem::path file, Format format, std::filesystem::path called)
    : file_(called.empty() ? file : std::move(called)) {
  silence_hdf5();
  const std::string expected = "an HDF5 file";
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) fail("file", "not found", expected);
  if (!std::filesystem::is_regular_file(status))
    fail("file", std::filesystem::is_directory(status) ? "a folder" : "not a regular file", expected);
  size_ = std::filesystem::file_size(file, error);
  if (size_ == 0) fail("file", "empty", expected);

  const Handle access(H5Pcreate(H5P_FILE_ACCESS));
  // Other readers may have it open, and some network file systems have no locks.
  H5Pset_file_locking(access.get(), false, true);
  id_ = H5Fopen(file.c_str(), H5F_ACC_RDONLY, access.get());
  if (id_ < 0) fail("file", hdf5_message(), "a whole HDF5 file");
  // HDF5 1.10 reads beyond what it holds where older, unchecked headers are damaged.
  H5F_info2_t info;
  const bool known = H5Fget_info2(id_, &info) >= 0;
  has_checksums_ = known && info.super.version >= 2;
  if (known && (has_checksums_ || format == Format::any)) return;
  H5Fclose(std::exchange(id_, -1));
  fail("file", "in HDF5's format without checksums", "of HDF5 1.8 or later (h5py: libver=\"v108\")");
}

Hdf5Reader::~Hdf5Reader() {
  if (id_ >= 0) H5Fclose(id_);
}

void Hdf5Reader::fail(const std::string& key, const std::string& value, const std::string& bound) const {
  throw InputError(file_.string(), key, value, bound);
}

bool Hdf5Reader::has(const std::string& path) const { return exists(id_, path); }

std::vector<std::string> Hdf5Reader::children(const std::string& group) const {
  const Handle object = hdf5::open_object(*this, id_, group);
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
  const Handle object = hdf5::open_object(*this, id_, path);
  if (H5Iget_type(object.get()) != H5I_DATASET) fail(path, "a group", "a dataset");
  const Handle space(H5Dget_space(object.get()));
  const auto dims = hdf5::extent_of(space.get());
  return {dims.begin(), dims.end()};
}

bool Hdf5Reader::holds_integers(const std::string& path) const {
  const Handle object = hdf5::open_object(*this, id_, path);
  if (H5Iget_type(object.get()) != H5I_DATASET) fail(path, "a group", "a dataset");
  return H5Tget_class(Handle(H5Dget_type(object.get())).get()) == H5T_INTEGER;
}

Eigen::VectorXd Hdf5Reader::vector(const std::string& path, std::int64_t n) const {
  const hdf5::Dataset data = hdf5::open_dataset(*this, id_, path, H5T_FLOAT, 1, n);
  Eigen::VectorXd values(static_cast<Eigen::Index>(data.count));
  hdf5::read_all(*this, path, data, H5T_NATIVE_DOUBLE, values.data());
  return values;
}

namespace {

/// A dataset of values by particle: [n], [n,K] or [n,K,L].
hdf5::Dataset open_values(const Hdf5Reader& reader, hid_t file, const std::string& path, H5T_class_t kind,
                          std::int64_t n) {
  const std::size_t rank = std::clamp<std::size_t>(reader.shape(path).size(), 1, 3);
  hdf5::Dataset data = hdf5::open_dataset(reader, file, path, kind, rank, n, hdf5::Extents::any);
  std::size_t each = 1;
  for (std::size_t axis = 1; axis < rank; ++axis) each *= static_cast<std::size_t>(data.dims[axis]);
  if (each < 1 || each > Hdf5Reader::most_components)
    reader.fail(path, hdf5::describe(data.type.get(), data.dims),
                fmt::format("1 to {} values per particle", Hdf5Reader::most_components));
  return data;
}

}  // namespace

Eigen::VectorXd Hdf5Reader::reals(const std::string& path, std::int64_t n) const {
  const hdf5::Dataset data = open_values(*this, id_, path, H5T_FLOAT, n);
  Eigen::VectorXd values(static_cast<Eigen::Index>(data.count));
  hdf5::read_all(*this, path, data, H5T_NATIVE_DOUBLE, values.data());
  return values;
}

Eigen::Matrix3Xd Hdf5Reader::matrix3(const std::string& path, std::int64_t n) const {
  const hdf5::Dataset data = hdf5::open_dataset(*this, id_, path, H5T_FLOAT, 2, n);
  Eigen::Matrix3Xd values(3, static_cast<Eigen::Index>(data.dims[0]));
  hdf5::read_all(*this, path, data, H5T_NATIVE_DOUBLE, values.data());
  return values;
}

namespace {

/// Entry `index` of a [T,n] or [T,n,3] dataset, as columns of `values`.
template <class Matrix>
Matrix read_entry(const Hdf5Reader& reader, const std::string& path, const hdf5::Dataset& data, std::int64_t index,
                  hid_t memory_type, Matrix values) {
  if (index < 0 || static_cast<hsize_t>(index) >= data.dims[0])
    reader.fail(path, hdf5::describe(data.type.get(), data.dims), fmt::format("to hold entry {}", index));
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
  return read_entry(*this, path, hdf5::open_dataset(*this, id_, path, H5T_FLOAT, 3, -1), index, H5T_NATIVE_DOUBLE,
                    Eigen::Matrix3Xd());
}

Eigen::VectorXd Hdf5Reader::vector_at(const std::string& path, std::int64_t index) const {
  return read_entry(*this, path, hdf5::open_dataset(*this, id_, path, H5T_FLOAT, 2, -1, hdf5::Extents::any), index,
                    H5T_NATIVE_DOUBLE, Eigen::VectorXd());
}

IdVector Hdf5Reader::integers_at(const std::string& path, std::int64_t index) const {
  return read_entry(*this, path, hdf5::open_dataset(*this, id_, path, H5T_INTEGER, 2, -1, hdf5::Extents::any), index,
                    H5T_NATIVE_INT64, IdVector());
}

IdVector Hdf5Reader::read_integers(const std::string& path, const hdf5::Dataset& data) const {
  IdVector values(static_cast<Eigen::Index>(data.count));
  const bool wide = H5Tget_size(data.type.get()) >= 8 && H5Tget_sign(data.type.get()) == H5T_SGN_NONE;
  // HDF5 would clip what int64 does not hold; read as unsigned, such a value turns negative.
  hdf5::read_all(*this, path, data, wide ? H5T_NATIVE_UINT64 : H5T_NATIVE_INT64, values.data());
  if (wide && values.size() > 0 && values.minCoeff() < 0)
    fail(path, std::to_string(static_cast<std::uint64_t>(values.minCoeff())), "at most 2^63 - 1");
  return values;
}

IdVector Hdf5Reader::integers(const std::string& path, std::int64_t n) const {
  return read_integers(path, hdf5::open_dataset(*this, id_, path, H5T_INTEGER, 1, n));
}

IdVector Hdf5Reader::integer_values(const std::string& path, std::int64_t n) const {
  return read_integers(path, open_values(*this, id_, path, H5T_INTEGER, n));
}

std::vector<std::string> Hdf5Reader::strings(const std::string& path, std::int64_t n) const {
  const hdf5::Dataset data = hdf5::open_dataset(*this, id_, path, H5T_STRING, 1, n);
  std::vector<std::string> values;
  const auto read = [&](hid_t type, void* out) {
    return data.count == 0 ? 0 : H5Dread(data.id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
  };
  if (!hdf5::read_strings(data.type.get(), data.count, read, values))
    fail(path, hdf5_message(), "readable; the file is damaged");
  return values;
}

std::string Hdf5Reader::text(const std::string& path) const {
  const hdf5::Dataset data = hdf5::open_dataset(*this, id_, path, H5T_STRING, 0, -1);
  std::vector<std::string> values;
  const auto read = [&](hid_t type, void* out) {
    return H5Dread(data.id.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
  };
  if (!hdf5::read_strings(data.type.get(), 1, read, values))
    fail(path, hdf5_message(), "readable; the file is damaged");
  return values.front();
}

std::vector<std::string> Hdf5Reader::attribute_names(const std::string& object) const {
  const Handle owner = hdf5::open_object(*this, id_, object);
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
  const Handle owner = hdf5::open_object(*this, id_, object);
  return H5Aexists(owner.get(), name.c_str()) > 0;
}

std::string Hdf5Reader::text_attribute(const std::string& object, const std::string& name) const {
  const hdf5::Attribute a = hdf5::open_attribute(
      *this, id_, object, name, [](H5T_class_t c) { return c == H5T_STRING; }, "a fixed-length string");
  std::vector<std::string> values;
  const auto read = [&](hid_t type, void* out) { return H5Aread(a.id.get(), type, out); };
  if (!hdf5::read_strings(a.type.get(), 1, read, values))
    fail(hdf5::attribute_key(object, name), hdf5_message(), "readable; the file is damaged");
  return values.front();
}

double Hdf5Reader::real_attribute(const std::string& object, const std::string& name) const {
  const hdf5::Attribute a = hdf5::open_attribute(
      *this, id_, object, name, [](H5T_class_t c) { return c == H5T_FLOAT || c == H5T_INTEGER; }, "a real number");
  double value = std::numeric_limits<double>::quiet_NaN();
  if (H5Aread(a.id.get(), H5T_NATIVE_DOUBLE, &value) < 0)
    fail(hdf5::attribute_key(object, name), hdf5_message(), "readable; the file is damaged");
  return value;
}

std::int64_t Hdf5Reader::integer_attribute(const std::string& object, const std::string& name) const {
  const hdf5::Attribute a =
      hdf5::open_attribute(*this, id_, object, name, [](H5T_class_t c) { return c == H5T_INTEGER; }, "an integer");
  std::int64_t value = 0;
  if (H5Aread(a.id.get(), H5T_NATIVE_INT64, &value) < 0)
    fail(hdf5::attribute_key(object, name), hdf5_message(), "readable; the file is damaged");
  return value;
}

}  // namespace decant
