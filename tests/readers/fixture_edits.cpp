/// \file
/// Edits by HDF5's own means, so that what the reader meets is a sound file with unsound contents.
#include "tests/readers/fixture_edits.hpp"

#include "oracle/files/hdf5_handle.hpp"
#include "tests/file_bytes.hpp"

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <vector>

namespace decant::readers {
namespace {

struct Object {
  std::string path;
  bool is_dataset;
};

/// The root, then everything below it, by name. Through links and attributes, which HDF5 1.10 and 1.14
/// declare alike; H5Ovisit and H5Oget_info they do not.
std::vector<Object> objects_in(hid_t file) {
  std::vector<Object> found = {{"/", false}};
  H5Lvisit(
      file, H5_INDEX_NAME, H5_ITER_INC,
      [](hid_t root, const char* name, const H5L_info_t* link, void* out) -> herr_t {
        if (link->type != H5L_TYPE_HARD) return 0;
        const Handle object(H5Oopen(root, name, H5P_DEFAULT));
        static_cast<std::vector<Object>*>(out)->push_back(
            {"/" + std::string(name), H5Iget_type(object.get()) == H5I_DATASET});
        return 0;
      },
      &found);
  return found;
}

std::vector<std::string> attributes_of(hid_t object) {
  std::vector<std::string> names;
  hsize_t next = 0;
  H5Aiterate2(
      object, H5_INDEX_NAME, H5_ITER_INC, &next,
      [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->push_back(name);
        return 0;
      },
      &names);
  return names;
}

class Edit {
 public:
  Edit(hid_t file, unsigned seed) : file_(file), random_(seed) {}

  void of(const Object& object) {
    switch (pick(object.is_dataset ? 6 : 2)) {
      case 0:
        return change_attribute(object.path);
      case 1:
        return unlink(object.path);
      case 2:
        return replace(object.path);
      case 3:
        return link_elsewhere(object.path);
      default:
        return set_value(object.path);
    }
  }
  std::size_t pick(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }

 private:
  hid_t type() {
    const std::array types = {H5T_NATIVE_FLOAT, H5T_NATIVE_DOUBLE, H5T_NATIVE_INT32,
                              H5T_NATIVE_INT64, H5T_NATIVE_UINT64, H5T_NATIVE_UINT8,
                              H5T_IEEE_F64BE,   H5T_NATIVE_B64,    H5T_STD_REF_OBJ};
    const std::size_t k = pick(types.size() + 2);
    if (k < types.size()) return H5Tcopy(types[k]);
    const hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, k == types.size() ? 1 + pick(9) : H5T_VARIABLE);
    return text;
  }

  hsize_t extent() {
    const std::array<hsize_t, 9> some = {0, 1, 2, 3, 4, 5, 7, hsize_t{1} << 33, hsize_t{1} << 61};
    return some[pick(some.size())];
  }

  /// A scalar, an empty one, or up to three axes; the large ones hold nothing.
  Handle space(bool& large) {
    const std::size_t rank = pick(5);
    large = false;
    if (rank == 0) return Handle(H5Screate(H5S_SCALAR));
    if (rank == 4) return Handle(H5Screate(H5S_NULL));
    std::array<hsize_t, 3> extents{};
    for (hsize_t& e : extents) {
      e = extent();
      large = large || e > 7;
    }
    return Handle(H5Screate_simple(static_cast<int>(rank), extents.data(), nullptr));
  }

  void unlink(const std::string& path) {
    if (path != "/") H5Ldelete(file_, path.c_str(), H5P_DEFAULT);
  }

  void replace(const std::string& path) {
    unlink(path);
    bool large = false;
    const Handle its_space = space(large), its_type(type()), layout(H5Pcreate(H5P_DATASET_CREATE));
    const int rank = H5Sget_simple_extent_ndims(its_space.get());
    if (large) {
      const std::array<hsize_t, 3> chunk = {64, 3, 1};
      H5Pset_chunk(layout.get(), rank, chunk.data());
    }
    const Handle made(
        H5Dcreate2(file_, path.c_str(), its_type.get(), its_space.get(), H5P_DEFAULT, layout.get(), H5P_DEFAULT));
  }

  void link_elsewhere(const std::string& path) {
    unlink(path);
    const std::array targets = {"/", "/state", "/scene", "/state/position", "/nowhere"};
    const std::size_t k = pick(targets.size() + 3);
    if (k < targets.size()) H5Lcreate_soft(targets[k], file_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    else if (k == targets.size()) H5Lcreate_soft(path.c_str(), file_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    else if (k == targets.size() + 1)
      H5Lcreate_external("elsewhere.h5", "/scene", file_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    else H5Lcreate_hard(file_, "/state", file_, path.c_str(), H5P_DEFAULT, H5P_DEFAULT);
  }

  double strange_number() {
    using Limits = std::numeric_limits<double>;
    const std::array some = {
        Limits::quiet_NaN(), Limits::infinity(), -1.0, 0.0, 1e300, Limits::denorm_min(), 0.1, -9.3e18, 1.0};
    return some[pick(some.size())];
  }

  void set_value(const std::string& path) {
    const Handle data(H5Dopen2(file_, path.c_str(), H5P_DEFAULT));
    const Handle its_space(H5Dget_space(data.get()));
    const hssize_t count = H5Sget_simple_extent_npoints(its_space.get());
    if (count <= 0 || count > 100000) return;
    const Handle its_type(H5Dget_type(data.get()));
    if (H5Tget_class(its_type.get()) == H5T_STRING) return;
    std::vector<double> values(static_cast<std::size_t>(count));
    if (H5Dread(data.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) return;
    values[pick(values.size())] = strange_number();
    H5Dwrite(data.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  }

  void change_attribute(const std::string& path) {
    const Handle object(H5Oopen(file_, path.c_str(), H5P_DEFAULT));
    const std::vector<std::string> names = attributes_of(object.get());
    if (names.empty()) return;
    const std::string& name = names[pick(names.size())];
    H5Adelete(object.get(), name.c_str());
    if (pick(4) == 0) return;
    bool large = false;
    const Handle its_space = space(large), its_type(type());
    if (large) return;
    const Handle attribute(
        H5Acreate2(object.get(), name.c_str(), its_type.get(), its_space.get(), H5P_DEFAULT, H5P_DEFAULT));
    const double value = strange_number();
    if (H5Sget_simple_extent_npoints(its_space.get()) == 1) H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, &value);
  }

  hid_t file_;
  std::mt19937 random_;
};

constexpr std::size_t seal_size = 8;

/// FNV-1a.
std::string seal_of(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  std::string seal(seal_size, '\0');
  std::memcpy(seal.data(), &hash, seal_size);
  return seal;
}

bool is_sealed(std::string_view bytes) {
  return bytes.size() > seal_size &&
         seal_of(bytes.substr(0, bytes.size() - seal_size)) == bytes.substr(bytes.size() - seal_size);
}

}  // namespace

ScratchFile::ScratchFile(std::string_view bytes)
    : path_(std::filesystem::temp_directory_path() / ("decant-reader-" + std::to_string(getpid()) + ".h5")) {
  std::ofstream(path_, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}
ScratchFile::~ScratchFile() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}
std::string ScratchFile::bytes() const { return test::bytes_of(path_); }

std::string edited_fixture(std::string_view bytes, unsigned seed) {
  if (!is_sealed(bytes)) return {};
  const ScratchFile scratch(bytes.substr(0, bytes.size() - seal_size));
  silence_hdf5();
  {
    const Handle file(H5Fopen(scratch.path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
    if (!file) return {};
    const std::vector<Object> objects = objects_in(file.get());
    if (objects.empty()) return {};
    Edit edit(file.get(), seed);
    edit.of(objects[edit.pick(objects.size())]);
  }
  const std::string edited = scratch.bytes();
  return edited + seal_of(edited);
}

}  // namespace decant::readers
