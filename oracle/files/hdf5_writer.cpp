/// \file
/// Writing: the same content gives the same bytes, and a file stands under its name whole or not at
/// all.
#include "oracle/files/hdf5_handle.hpp"
#include "oracle/files/hdf5_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace decant {
namespace {

constexpr hsize_t values_per_chunk = 65536;
constexpr std::size_t memory_step = 1 << 22;  // bytes the image grows by

}  // namespace

struct Hdf5Writer::Layout {
  hid_t file_type, memory_type;
  std::vector<hsize_t> dims;
};

Hdf5Writer::Hdf5Writer(std::filesystem::path file, int level) : out_(std::move(file)), level_(level) {
  silence_hdf5();
  // In memory until commit: HDF5 1.10 crashes when a disk is full.
  const Handle access(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_fapl_core(access.get(), memory_step, false);
  id_ = create_file(out_.aside().string(), access).release();
  if (id_ < 0) fail("file", hdf5_message());
}

Hdf5Writer::~Hdf5Writer() {
  if (id_ >= 0) H5Fclose(id_);
}

void Hdf5Writer::fail(const std::string& object, const std::string& what) const {
  throw std::runtime_error(fmt::format("{}: {}: cannot be written: {}", out_.file().string(), object, what));
}

void Hdf5Writer::dataset(const std::string& path, const Layout& layout, const void* values, std::string_view unit,
                         std::string_view description) {
  const auto& dims = layout.dims;
  const bool holds_values = std::find(dims.begin(), dims.end(), hsize_t{0}) == dims.end();
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
  if (holds_values && !dims.empty() && level_ > 0) {
    std::vector<hsize_t> chunk = dims;
    chunk[0] = std::min(dims[0], values_per_chunk / (dims.size() > 1 ? dims[1] : 1));
    H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data());
    H5Pset_shuffle(creation.get());
    H5Pset_deflate(creation.get(), static_cast<unsigned>(level_));
  }
  const Handle data = make_dataset(id_, path, layout.file_type, dims, creation);
  if (!data) fail(path, hdf5_message());
  if (holds_values && H5Dwrite(data.get(), layout.memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
    fail(path, hdf5_message());
  if (!unit.empty()) attribute(path, "unit", unit);
  if (!description.empty()) attribute(path, "description", description);
}

void Hdf5Writer::vector(const std::string& path, const Eigen::VectorXd& values, std::string_view unit,
                        std::string_view description, Storage storage) {
  const std::vector<hsize_t> dims = {static_cast<hsize_t>(values.size())};
  if (storage == Storage::fp64)
    return dataset(path, {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, dims}, values.data(), unit, description);
  const Eigen::VectorXf single = values.cast<float>();
  dataset(path, {H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, dims}, single.data(), unit, description);
}

void Hdf5Writer::matrix3(const std::string& path, const Eigen::Matrix3Xd& values, std::string_view unit,
                         std::string_view description, Storage storage) {
  const std::vector<hsize_t> dims = {static_cast<hsize_t>(values.cols()), 3};
  if (storage == Storage::fp64)
    return dataset(path, {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, dims}, values.data(), unit, description);
  const Eigen::Matrix3Xf single = values.cast<float>();
  dataset(path, {H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, dims}, single.data(), unit, description);
}

void Hdf5Writer::integers(const std::string& path, const IdVector& values, std::string_view description) {
  dataset(path, {H5T_STD_I64LE, H5T_NATIVE_INT64, {static_cast<hsize_t>(values.size())}}, values.data(), {},
          description);
}

void Hdf5Writer::bytes(const std::string& path, const std::vector<std::uint8_t>& values, std::string_view description) {
  dataset(path, {H5T_STD_U8LE, H5T_NATIVE_UINT8, {values.size()}}, values.data(), {}, description);
}

void Hdf5Writer::strings(const std::string& path, const std::vector<std::string>& values,
                         std::string_view description) {
  std::size_t size = 1;
  for (const auto& value : values) {
    if (value.find('\0') != std::string::npos) fail(path, "a string holds NUL");
    size = std::max(size, value.size());
  }
  std::vector<char> padded(values.size() * size, '\0');
  for (std::size_t k = 0; k < values.size(); ++k)
    std::copy(values[k].begin(), values[k].end(), padded.begin() + static_cast<std::ptrdiff_t>(k * size));
  const Handle type = utf8_type(size);
  dataset(path, {type.get(), type.get(), {values.size()}}, padded.data(), {}, description);
}

void Hdf5Writer::text(const std::string& path, std::string_view text, std::string_view description) {
  if (text.find('\0') != std::string_view::npos) fail(path, "a string holds NUL");
  const std::string whole = text.empty() ? std::string(1, '\0') : std::string(text);
  const Handle type = utf8_type(whole.size());
  dataset(path, {type.get(), type.get(), {}}, whole.data(), {}, description);
}

void Hdf5Writer::group(const std::string& path) {
  if (!make_group(id_, path)) fail(path, hdf5_message());
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name, std::string_view text) {
  const std::string whole = text.empty() ? std::string(1, '\0') : std::string(text);
  if (text.find('\0') != std::string_view::npos) fail(object + "@" + name, "a string holds NUL");
  const Handle type = utf8_type(whole.size());
  group(object);
  if (!write_attribute(id_, object, name, type.get(), type.get(), whole.data()))
    fail(object + "@" + name, hdf5_message());
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name, double value) {
  group(object);
  if (!write_attribute(id_, object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value))
    fail(object + "@" + name, hdf5_message());
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name, std::int64_t value) {
  group(object);
  if (!write_attribute(id_, object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value))
    fail(object + "@" + name, hdf5_message());
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name,
                           const std::vector<std::int64_t>& values) {
  group(object);
  if (!write_attribute(id_, object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, values.data(), {values.size()}))
    fail(object + "@" + name, hdf5_message());
}

void Hdf5Writer::ascii_attribute(const std::string& object, const std::string& name, std::string_view text) {
  const Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), text.size());
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  group(object);
  if (!write_attribute(id_, object, name, type.get(), type.get(), text.data()))
    fail(object + "@" + name, hdf5_message());
}

void Hdf5Writer::commit() {
  // The driver's own memory: H5Fget_file_image clears a flag and leaves its checksum as it was.
  void* memory = nullptr;
  const ssize_t size = H5Fflush(id_, H5F_SCOPE_GLOBAL) < 0 || H5Fget_vfd_handle(id_, H5P_DEFAULT, &memory) < 0
                           ? -1
                           : H5Fget_file_image(id_, nullptr, 0);
  if (size < 0) fail("file", hdf5_message());
  out_.write({*static_cast<const char**>(memory), static_cast<std::size_t>(size)});
  out_.commit();
  H5Fclose(std::exchange(id_, -1));
}

}  // namespace decant
