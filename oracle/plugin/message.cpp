/// \file
/// Messages over a socket.
#include "oracle/plugin/message.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <thread>

namespace decant::plugin {
namespace {

struct Header {
  std::uint32_t code;
  std::uint32_t unused;
  std::uint64_t size;
};
/// Nobody sends as much; a header like that is no header.
constexpr std::uint64_t most_bytes = std::uint64_t{1} << 40;

using Clock = std::chrono::steady_clock;

/// Waking a process up takes longer than a substep of a small scene; where there are cores to spare the reader stays
/// awake for so long, giving its core to whoever asks.
constexpr auto awake = std::chrono::milliseconds(10);

/// What is there to read before it is worth to sleep, at most `size` bytes; 0: nothing yet. Throws where nobody is left.
std::size_t receive_soon(int socket, char* data, std::size_t size) {
  static const bool cores_to_spare = std::thread::hardware_concurrency() >= 4;
  if (!cores_to_spare) return 0;
  for (const auto until = Clock::now() + awake; Clock::now() < until; ::sched_yield()) {
    const ssize_t got = ::recv(socket, data, size, MSG_DONTWAIT);
    if (got > 0) return static_cast<std::size_t>(got);
    if (got == 0 || (errno != EAGAIN && errno != EINTR)) throw Silence("the other end is gone");
  }
  return 0;
}

void receive_all(int socket, char* data, std::size_t size, std::optional<Clock::time_point> end) {
  while (size > 0) {
    if (end) {
      const auto left = std::chrono::duration<double, std::milli>(*end - Clock::now()).count();
      pollfd ready{socket, POLLIN, 0};
      const int count = left <= 0 ? 0 : ::poll(&ready, 1, static_cast<int>(std::min(std::ceil(left), 1e6)));
      if (count < 0 && errno == EINTR) continue;
      if (count == 0 && Clock::now() < *end) continue;
      if (count == 0) {
        Silence silence("no answer in time");
        silence.timed_out = true;
        throw silence;
      }
    }
    const ssize_t got = ::recv(socket, data, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) throw Silence("the other end is gone");
    data += got;
    size -= static_cast<std::size_t>(got);
  }
}

}  // namespace

void send(int socket, const Message& message) {
  Header header{static_cast<std::uint32_t>(message.code), 0, message.bytes.size()};
  // In one piece, so that the reader wakes once.
  std::array<iovec, 2> pieces{iovec{&header, sizeof header},
                              iovec{const_cast<char*>(message.bytes.data()), message.bytes.size()}};
  while (pieces[0].iov_len + pieces[1].iov_len > 0) {
    msghdr whole{};
    whole.msg_iov = pieces.data();
    whole.msg_iovlen = pieces.size();
    ssize_t sent = ::sendmsg(socket, &whole, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) throw Silence(fmt::format("nobody reads: {}", std::strerror(errno)));
    for (iovec& piece : pieces) {
      const std::size_t part = std::min(piece.iov_len, static_cast<std::size_t>(sent));
      piece.iov_base = static_cast<char*>(piece.iov_base) + part;
      piece.iov_len -= part;
      sent -= static_cast<ssize_t>(part);
    }
  }
}

Message receive(int socket, std::optional<std::chrono::duration<double>> limit) {
  std::optional<Clock::time_point> end;
  if (limit) end = Clock::now() + std::chrono::duration_cast<Clock::duration>(*limit);
  // Requests and answers alternate, so that what comes is of one message; most are small and come at once.
  std::array<char, 4096> first;
  std::size_t there = receive_soon(socket, first.data(), first.size());
  Header header{};
  if (there < sizeof header) {
    receive_all(socket, first.data() + there, sizeof header - there, end);
    there = sizeof header;
  }
  std::memcpy(&header, first.data(), sizeof header);
  if (header.size > most_bytes || there - sizeof header > header.size) throw Silence("what came is no message");
  Message message{static_cast<Code>(header.code), {}};
  message.bytes.resize(static_cast<std::size_t>(header.size));
  const std::size_t body = there - sizeof header;
  std::memcpy(message.bytes.data(), first.data() + sizeof header, body);
  receive_all(socket, message.bytes.data() + body, message.bytes.size() - body, end);
  return message;
}

}  // namespace decant::plugin
