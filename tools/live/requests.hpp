/// \file
/// Which requests are answered, and with what.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace decant::live {

/// What a request says of itself.
struct Request {
  std::string_view method, target, host, origin;  // empty: not said
  bool upgrade = false;                           // to a WebSocket
};

struct Answer {
  int status = 200;
  std::string_view type, body;
  bool socket = false;  // the request becomes a WebSocket
};

/// Answers for the page below /token/.
class Requests {
 public:
  /// A token of 128 random bits, in hexadecimal. Throws std::runtime_error where there is no randomness.
  static std::string new_token();

  explicit Requests(std::string token) : token_(std::move(token)) {}

  Answer answer(const Request& request) const;
  const std::string& token() const { return token_; }

 private:
  std::string token_;
};

}  // namespace decant::live
