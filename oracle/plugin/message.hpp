/// \file
/// What passes between a command and the process of a plug-in: numbered messages of bytes over a socket, and how data
/// are packed into them. Both ends are of one build, so that memory layouts agree.
#pragma once

#include "reference/scene.hpp"

#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace decant::plugin {

/// Requests, each answered by `done` with what it asks for, or `failed` with a text.
enum class Code : std::uint32_t { load = 1, evaluate, advance, read, lists, stage_times, done, failed };

struct Message {
  Code code{};
  std::string bytes;
};

/// The other end is gone, or was silent for too long.
struct Silence : std::runtime_error {
  using std::runtime_error::runtime_error;
  bool timed_out = false;
};

/// Throws Silence where nobody reads.
void send(int socket, const Message& message);

/// The next message. Throws Silence. \param limit  to wait for its end; none: forever
Message receive(int socket, std::optional<std::chrono::duration<double>> limit);

/// Packs values one after the other.
class Packer {
 public:
  static constexpr bool reads = false;
  std::string bytes;

  template <class T>
    requires std::is_trivially_copyable_v<T>
  void operator()(const T& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void raw(const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); }
};

/// Takes them out in the same order. Throws std::runtime_error where there are not that many.
class Unpacker {
 public:
  static constexpr bool reads = true;
  explicit Unpacker(const std::string& bytes) : at_(bytes.data()), end_(at_ + bytes.size()) {}

  template <class T>
    requires std::is_trivially_copyable_v<T>
  void operator()(T& value) {
    raw(&value, sizeof value);
  }
  void raw(void* data, std::size_t size) {
    if (size > left()) throw std::runtime_error("a message is cut off");
    if (size > 0) std::memcpy(data, at_, size);
    at_ += size;
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

 private:
  const char *at_, *end_;
};

/// A count and as many values, which must be there.
template <class Archive, class Resizable>
std::size_t pack_size(Archive& archive, Resizable& values, std::size_t bytes_each) {
  std::uint64_t count = static_cast<std::uint64_t>(values.size());
  archive(count);
  if constexpr (Archive::reads)
    if (count > archive.left() / bytes_each) throw std::runtime_error("a message is cut off");
  return static_cast<std::size_t>(count);
}

template <class Archive>
void pack(Archive& archive, std::string& text) {
  const std::size_t size = pack_size(archive, text, 1);
  if constexpr (Archive::reads) text.resize(size);
  archive.raw(text.data(), size);
}

template <class Archive, class T>
  requires std::is_trivially_copyable_v<T>
void pack(Archive& archive, std::vector<T>& values) {
  const std::size_t size = pack_size(archive, values, sizeof(T));
  if constexpr (Archive::reads) values.resize(size);
  archive.raw(values.data(), size * sizeof(T));
}

/// A matrix whose rows are known, or a vector.
template <class Archive, class Scalar, int rows>
void pack(Archive& archive, Eigen::Matrix<Scalar, rows, rows == Eigen::Dynamic ? 1 : Eigen::Dynamic>& values) {
  std::uint64_t count = static_cast<std::uint64_t>(values.size());
  archive(count);
  if constexpr (Archive::reads) {
    if (count > archive.left() / sizeof(Scalar)) throw std::runtime_error("a message is cut off");
    const auto n = static_cast<Eigen::Index>(count);
    if constexpr (rows == Eigen::Dynamic) values.resize(n);
    else values.resize(rows, n / rows);
  }
  archive.raw(values.data(), static_cast<std::size_t>(count) * sizeof(Scalar));
}

/// What callbacks of a plug-in need of a container: its solid and its motion.
template <class Archive>
void pack(Archive& archive, Container& c) {
  auto index = static_cast<std::uint32_t>(c.shape.index());
  archive(index);
  if constexpr (Archive::reads) {
    if (index == 0) c.shape = RevolvedShape{};
    else c.shape = BoxShape{};
  }
  const auto corners = [&](SolidBox& box) {
    for (Vec3* corner : {&box.min, &box.max}) archive.raw(corner->data(), sizeof(double) * 3);
  };
  const auto vector = [&](Vec3& v) { archive.raw(v.data(), sizeof(double) * 3); };
  if (auto* revolved = std::get_if<RevolvedShape>(&c.shape)) {
    pack(archive, revolved->profile);
  } else {
    auto& box = std::get<BoxShape>(c.shape);
    corners(box.cavity);
    const std::size_t count = pack_size(archive, box.solid, sizeof(double) * 6);
    if constexpr (Archive::reads) box.solid.resize(count);
    for (SolidBox& solid : box.solid) corners(solid);
    archive(box.endless);
  }
  vector(c.origin);
  archive(c.wall_thickness);
  vector(c.surface_velocity);
  const auto given = [&](auto& optional) {
    bool there = optional.has_value();
    archive(there);
    if constexpr (Archive::reads)
      if (there) optional.emplace();
    return there;
  };
  if (given(c.tilt)) {
    vector(c.tilt->pivot);
    vector(c.tilt->axis);
    pack(archive, c.tilt->keys);
    archive(c.tilt->rate);
    if (given(c.tilt->oscillation)) archive(*c.tilt->oscillation);
  }
  if (given(c.translation)) {
    const std::size_t count = pack_size(archive, c.translation->keys, sizeof(double) * 4);
    if constexpr (Archive::reads) c.translation->keys.resize(count);
    for (TranslationKey& key : c.translation->keys) {
      archive(key.time);
      vector(key.offset);
    }
    vector(c.translation->velocity);
    if (given(c.translation->oscillation)) {
      vector(c.translation->oscillation->amplitude);
      archive(c.translation->oscillation->frequency);
      archive(c.translation->oscillation->phase);
    }
  }
}

}  // namespace decant::plugin
