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
  /// Opens the port. Throws InputError where it cannot be had.
  /// \param port  0: one that is free
  explicit Server(std::uint16_t port);
  ~Server() override;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Serves by a thread of its own. \param asked  takes what pages ask; called by that thread, until `stop`
  void serve(std::function<void(std::string)> asked);
  /// Ends that thread and hangs up. A run may go on showing: nobody sees it.
  void stop();

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
