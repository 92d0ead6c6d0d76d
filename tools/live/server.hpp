/// \file
/// The page and its WebSocket on the loopback address. By Boost.Beast: header-only, so that nothing is linked or
/// carried along, and kept up with Boost.
///
/// Whoever knows the token is served: it is in the path of every address, 128 random bits. Requests whose Host is not this
/// machine's own name (DNS rebinding), and sockets opened by a page of another origin, are refused.
#pragma once

#include "tools/live/run.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace decant::live {

class Server : public Viewer {
 public:
  /// Opens the port and serves by a thread of its own. Throws InputError where the port cannot be had.
  /// \param port  0: one that is free; \param asked  what pages ask, called by that thread
  Server(std::uint16_t port, std::function<void(std::string)> asked);
  ~Server() override;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// "http://127.0.0.1:PORT/TOKEN/"
  std::string address() const;

  bool watched() const override;
  bool wants_picture() const override;
  void picture(Message bytes) override;
  void tell(const nlohmann::ordered_json& message) override;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace decant::live
