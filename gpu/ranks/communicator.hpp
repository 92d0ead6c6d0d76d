/// \file
/// How ranks talk: collective operations on host memory, of threads in one process or of MPI processes. All
/// ranks make the same calls in the same order.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace decant::gpu {

using Bytes = std::vector<std::byte>;

/// Bytes for, or from, one rank.
struct Segment {
  void* data = nullptr;
  std::size_t bytes = 0;
};

/// Moves bytes between device memories, in the order of a stream (a cudaStream_t), without waiting for it.
class DeviceExchange {
 public:
  virtual ~DeviceExchange() = default;
  /// As Communicator::exchange; what differs in size is not noticed.
  virtual void exchange(std::span<const Segment> send, std::span<const Segment> receive, void* stream) = 0;
};

/// Every operation throws BackendError once any rank has failed.
class Communicator {
 public:
  virtual ~Communicator() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  /// Every rank gets what rank 0 has.
  virtual void broadcast(Bytes& data) = 0;
  /// What each rank has, at rank 0, by rank; nothing elsewhere.
  virtual std::vector<Bytes> gather(const Bytes& own) = 0;
  /// all[k·bytes …] = what rank k has; as many bytes of each.
  virtual void all_gather(const void* own, std::size_t bytes, void* all) = 0;
  /// send[k] goes to rank k, receive[k] comes from it; neither from a rank to itself.
  /// Throws BackendError where the sizes of the two sides differ.
  virtual void exchange(std::span<const Segment> send, std::span<const Segment> receive) = 0;
  /// Ends what the others wait for: their operations throw, or their processes end, with this reason.
  virtual void fail(const std::string& why) noexcept = 0;

  /// Of the same ranks' devices, once somebody has asked for it, null where there is none; one serves all solvers.
  std::optional<std::unique_ptr<DeviceExchange>> between_devices;

  /// What each rank has, by rank.
  template <class T>
  std::vector<T> all(const T& own) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> values(static_cast<std::size_t>(size()));
    all_gather(&own, sizeof own, values.data());
    return values;
  }
  /// Whether any rank says so.
  bool any(bool own) {
    for (const char says : all(static_cast<char>(own)))
      if (says) return true;
    return false;
  }
};

/// The communicators of `ranks` threads of this process, by rank.
std::vector<std::unique_ptr<Communicator>> thread_communicators(int ranks);

/// Values one after the other as bytes: trivially copyable ones, and vectors of such.
class Writer {
 public:
  template <class T>
  Writer& operator<<(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    put(&value, sizeof value);
    return *this;
  }
  template <class T>
  Writer& operator<<(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_same_v<T, bool>);
    *this << values.size();
    put(values.data(), values.size() * sizeof(T));
    return *this;
  }
  Bytes take() { return std::move(bytes_); }

 private:
  void put(const void* from, std::size_t bytes) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + bytes);
    if (bytes > 0) std::memcpy(bytes_.data() + at, from, bytes);
  }
  Bytes bytes_;
};

/// The same the other way, in the same order.
class Reader {
 public:
  explicit Reader(const Bytes& bytes) : bytes_(bytes) {}
  template <class T>
  Reader& operator>>(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    get(&value, sizeof value);
    return *this;
  }
  template <class T>
  Reader& operator>>(std::vector<T>& values) {
    std::size_t count = 0;
    *this >> count;
    values.resize(count);
    get(values.data(), count * sizeof(T));
    return *this;
  }

 private:
  void get(void* to, std::size_t bytes) {
    if (bytes > 0) std::memcpy(to, bytes_.data() + at_, bytes);
    at_ += bytes;
  }
  const Bytes& bytes_;
  std::size_t at_ = 0;
};

}  // namespace decant::gpu
