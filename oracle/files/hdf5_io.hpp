/// \file
/// The little of HDF5 that Decant needs: whole datasets in and out, checked shapes, files that
/// appear whole or not at all. Every error names file and dataset.
///
/// Strings are fixed-length UTF-8 padded with NUL, in datasets and attributes alike (h5py hands
/// them out as bytes); variable-length ones are neither written nor read, because HDF5 1.10 hangs
/// on a damaged heap of them. The same content gives the same bytes. HDF5's serial library is not
/// thread-safe: one thread at a time.
#pragma once

#include "oracle/files/file_aside.hpp"
#include "reference/state.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <hdf5.h>

namespace decant {

namespace hdf5 {
struct Dataset;
}

/// File open for reading. Throws InputError where the file is missing, truncated, not HDF5, or
/// where an object is missing, of the wrong class, rank or length, claims more than the file can
/// hold, or leads out of the file. The error's key is the dataset's path, or `object@attribute`, or
/// "file".
class Hdf5Reader {
 public:
  /// Which formats of HDF5 are read: those whose headers carry checksums, or the older one too.
  enum class Format { checksums, any };

  /// \param called  what messages name in place of the file; empty: the file
  explicit Hdf5Reader(std::filesystem::path file, Format format = Format::checksums, std::filesystem::path called = {});
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  /// True where a group or dataset stands at the path.
  bool has(const std::string& path) const;
  /// Names in a group, sorted.
  std::vector<std::string> children(const std::string& group) const;
  /// Extent by axis; empty for a scalar.
  std::vector<std::int64_t> shape(const std::string& path) const;
  /// Whether a dataset's type is an integer.
  bool holds_integers(const std::string& path) const;
  /// [n] dataset of reals; n < 0 takes any length.
  Eigen::VectorXd vector(const std::string& path, std::int64_t n = -1) const;
  /// [n,3] dataset of reals as 3×n.
  Eigen::Matrix3Xd matrix3(const std::string& path, std::int64_t n = -1) const;
  /// One entry of a [T,n,3] dataset as 3×n.
  Eigen::Matrix3Xd matrix3_at(const std::string& path, std::int64_t index) const;
  /// One entry of a [T,n] dataset of reals, or of integers that int64 holds.
  Eigen::VectorXd vector_at(const std::string& path, std::int64_t index) const;
  IdVector integers_at(const std::string& path, std::int64_t index) const;
  /// [n] dataset of integers of any width; one beyond int64 is refused.
  IdVector integers(const std::string& path, std::int64_t n = -1) const;
  /// Values by particle, all of the first, then of the second, …: [n], or [n,K] and [n,K,L] with K or K L values per
  /// particle, most_components at most.
  Eigen::VectorXd reals(const std::string& path, std::int64_t n = -1) const;
  IdVector integer_values(const std::string& path, std::int64_t n = -1) const;
  static constexpr std::size_t most_components = 1024;
  /// [n] dataset of strings.
  std::vector<std::string> strings(const std::string& path, std::int64_t n = -1) const;
  /// Scalar dataset that holds one string.
  std::string text(const std::string& path) const;

  /// Names of an object's attributes, sorted.
  std::vector<std::string> attribute_names(const std::string& object) const;
  bool has_attribute(const std::string& object, const std::string& name) const;
  std::string text_attribute(const std::string& object, const std::string& name) const;
  /// A real or an integer.
  double real_attribute(const std::string& object, const std::string& name) const;
  std::int64_t integer_attribute(const std::string& object, const std::string& name) const;

  const std::filesystem::path& file() const { return file_; }
  std::uintmax_t file_size() const { return size_; }
  /// False of a file in the older format.
  bool has_checksums() const { return has_checksums_; }
  /// The file's identifier, for what is not above.
  hid_t id() const { return id_; }
  /// Throws InputError(file, key, value, bound); for callers that find a value out of bounds.
  [[noreturn]] void fail(const std::string& key, const std::string& value, const std::string& bound) const;

 private:
  IdVector read_integers(const std::string& path, const hdf5::Dataset& data) const;

  std::filesystem::path file_;
  std::uintmax_t size_ = 0;
  bool has_checksums_ = false;
  hid_t id_ = -1;
};

/// How a real dataset is stored.
enum class Storage { fp64, fp32 };

/// New file, kept in memory (compressed) until `commit` writes it beside its place under a hidden
/// temporary name and renames it; without `commit` nothing is left behind. Throws
/// std::runtime_error naming file and object where writing fails. Datasets are compressed (shuffle
/// + deflate); missing groups are made. `unit` and `description` become attributes where they are
/// not empty.
class Hdf5Writer {
 public:
  /// \param level  deflate level, 0 (none) … 9
  explicit Hdf5Writer(std::filesystem::path file, int level = 4);
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  /// [n] reals.
  void vector(const std::string& path, const Eigen::VectorXd& values, std::string_view unit,
              std::string_view description = {}, Storage storage = Storage::fp64);
  /// 3×n as [n,3] reals.
  void matrix3(const std::string& path, const Eigen::Matrix3Xd& values, std::string_view unit,
               std::string_view description = {}, Storage storage = Storage::fp64);
  /// [n] int64.
  void integers(const std::string& path, const IdVector& values, std::string_view description = {});
  /// [n] uint8.
  void bytes(const std::string& path, const std::vector<std::uint8_t>& values, std::string_view description = {});
  /// [n] fixed-length UTF-8; a string may not hold NUL.
  void strings(const std::string& path, const std::vector<std::string>& values, std::string_view description = {});
  /// Scalar fixed-length UTF-8.
  void text(const std::string& path, std::string_view text, std::string_view description = {});
  /// Makes a group where it is missing.
  void group(const std::string& path);
  /// Attribute of a group (made where missing) or dataset.
  void attribute(const std::string& object, const std::string& name, std::string_view text);
  void attribute(const std::string& object, const std::string& name, double value);
  void attribute(const std::string& object, const std::string& name, std::int64_t value);
  void attribute(const std::string& object, const std::string& name, int value) {
    attribute(object, name, static_cast<std::int64_t>(value));
  }
  void attribute(const std::string& object, const std::string& name, const char* text) {
    attribute(object, name, std::string_view(text));
  }
  /// [n] int64.
  void attribute(const std::string& object, const std::string& name, const std::vector<std::int64_t>& values);
  /// Fixed-length ASCII, which some readers insist on.
  void ascii_attribute(const std::string& object, const std::string& name, std::string_view text);
  /// The file's identifier, for what HDF5 can do beyond the above.
  hid_t id() const { return id_; }
  /// Writes to the disk and renames into place; the last call on a writer.
  void commit();

 private:
  struct Layout;
  void dataset(const std::string& path, const Layout& layout, const void* values, std::string_view unit,
               std::string_view description);
  [[noreturn]] void fail(const std::string& object, const std::string& what) const;

  // Opened with the writer, so that a place that cannot be written is known before the work.
  FileAside out_;
  hid_t id_ = -1;
  int level_;
};

}  // namespace decant
