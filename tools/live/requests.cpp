/// \file
/// Refusals first; then the files of the page by name.
#include "tools/live/requests.hpp"

#include "tools/live/page.hpp"

#include <array>
#include <cstdint>
#include <random>

namespace decant::live {
namespace {

Answer refused(int status, std::string_view why) { return {status, "text/plain; charset=utf-8", why, false}; }

/// As long whatever differs, so that a token cannot be guessed byte by byte.
bool same(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    difference |= static_cast<unsigned char>(a[k]) ^ static_cast<unsigned char>(b[k]);
  return difference == 0;
}

/// Of this machine, at any port: the far end of a tunnel has another one.
bool is_loopback(std::string_view host) {
  for (const std::string_view name : {"127.0.0.1", "localhost", "[::1]"}) {
    if (!host.starts_with(name)) continue;
    std::string_view port = host.substr(name.size());
    if (port.empty()) return true;
    if (port.front() == ':' && port.find_first_not_of("0123456789", 1) == port.npos) return true;
  }
  return false;
}

}  // namespace

std::string Requests::new_token() {
  std::random_device random;
  std::string token;
  for (int word = 0; word < 4; ++word)
    for (std::uint32_t bits = random(), digit = 0; digit < 8; ++digit, bits >>= 4)
      token += "0123456789abcdef"[bits & 15];
  return token;
}

Answer Requests::answer(const Request& request) const {
  if (!is_loopback(request.host)) return refused(403, "only by the name of the loopback address\n");
  std::string_view target = request.target.substr(0, request.target.find('?'));
  if (!target.starts_with('/')) return refused(404, "nothing here\n");
  target.remove_prefix(1);
  const auto slash = target.find('/');
  // Without its token the address says nothing, not even whether there is a page.
  if (slash == target.npos || !same(target.substr(0, slash), token_)) return refused(404, "nothing here\n");
  target.remove_prefix(slash + 1);
  if (request.method != "GET" && request.method != "HEAD") return refused(405, "GET and HEAD only\n");
  if (target == "socket") {
    if (!request.upgrade) return refused(426, "a WebSocket\n");
    // Programs that are no browsers send none.
    if (!request.origin.empty() && request.origin != "http://" + std::string(request.host))
      return refused(403, "a page of another origin\n");
    Answer answer;
    answer.socket = true;
    return answer;
  }
  for (const PageFile& file : page_files())
    if (file.name == target) return {200, file.type, file.bytes, false};
  return refused(404, "nothing here\n");
}

}  // namespace decant::live
