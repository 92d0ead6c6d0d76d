/// \file
/// One thread, one loop: accepting, requests, sockets. Whoever has not drawn the picture before gets no further one, so
/// that a slow page falls behind by one picture and holds none up.
#include "tools/live/server.hpp"

#include "reference/error.hpp"
#include "tools/live/requests.hpp"

#include <fmt/format.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <atomic>
#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <thread>
#include <utility>

namespace decant::live {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t most_pages = 32, longest_request = 8192, longest_ask = 4 << 20, longest_backlog = 64;

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

class Server::Implementation {
 public:
  class Page;

  explicit Implementation(std::uint16_t port) : requests_(Requests::new_token()), acceptor_(loop_) {
    error_code error;
    const tcp::endpoint here(asio::ip::address_v4::loopback(), port);
    acceptor_.open(here.protocol(), error);
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor_.bind(here, error);
    if (!error) acceptor_.listen(tcp::acceptor::max_listen_connections, error);
    if (error)
      throw InputError("command line", "--port", std::to_string(port), "a free port (" + error.message() + ")");
    port_ = acceptor_.local_endpoint().port();
  }

  void start(std::function<void(std::string)> asked) {
    asked_ = std::move(asked);
    accept();
    thread_ = std::thread([this] { serve(); });
  }
  void stop() {
    if (!thread_.joinable()) return;
    loop_.stop();
    thread_.join();
    looking_ = waiting_ = 0;
  }

  void serve();
  void accept();
  void picture(Message bytes);
  void drawn(Page& page);
  void tell(const std::string& type, Message text);
  void join(const std::shared_ptr<Page>& page);
  void leave(const std::shared_ptr<Page>& page);
  asio::io_context& loop() { return loop_; }
  /// Pages that look, and those among them that have drawn the picture before.
  void count();

  std::function<void(std::string)> asked_;
  const Requests requests_;
  std::uint16_t port_ = 0;
  std::atomic<int> looking_ = 0, waiting_ = 0;

 private:
  asio::io_context loop_;
  tcp::acceptor acceptor_;
  asio::steady_timer pause_{loop_};
  std::set<std::shared_ptr<Page>> pages_;
  std::map<std::string, Message> last_;  // told, by type; for who comes later
  Message last_picture_;
  std::thread thread_;
};

/// A connection: requests one after another, and a socket in the end.
class Server::Implementation::Page : public std::enable_shared_from_this<Page> {
 public:
  Page(tcp::socket socket, Implementation& server) : server_(server), stream_(std::move(socket)) {}

  void read_request();
  void send(Message bytes, bool binary);
  void close() { beast::get_lowest_layer(*socket_).close(); }
  void send_picture(const Message& picture) {
    drawn = false;
    sent_ = picture;
    send(picture, true);
  }
  bool drawn = true;
  /// Whether a later picture was made since.
  bool behind(const Message& picture) const { return sent_ != picture; }

 private:
  void answer(const error_code& error);
  void open_socket();
  void read_ask();
  void write();

  struct Outgoing {
    Message bytes;
    bool binary;
  };

  Implementation& server_;
  Message sent_;  // the last picture
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<websocket::stream<beast::tcp_stream>> socket_;
  std::deque<Outgoing> outgoing_;  // the first one is under way
};

void Server::Implementation::Page::read_request() {
  parser_.emplace();
  parser_->header_limit(longest_request);
  parser_->body_limit(0);
  stream_.expires_after(std::chrono::seconds(30));
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](const error_code& error, std::size_t) { self->answer(error); });
}

void Server::Implementation::Page::answer(const error_code& error) {
  if (error) return;
  const auto& asked = parser_->get();
  const Answer answer =
      server_.requests_.answer({view(asked.method_string()), view(asked.target()), view(asked[http::field::host]),
                                view(asked[http::field::origin]), websocket::is_upgrade(asked)});
  if (answer.socket) return open_socket();
  const bool head = asked.method() == http::verb::head;
  auto response = std::make_shared<http::response<http::string_body>>(static_cast<http::status>(answer.status), 11);
  response->set(http::field::content_type, beast::string_view(answer.type.data(), answer.type.size()));
  response->set(http::field::cache_control, "no-store");
  response->set(
      "Content-Security-Policy",
      fmt::format("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src "
                  "'self' ws://{}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
                  view(asked[http::field::host])));
  response->set("Referrer-Policy", "no-referrer");
  response->set("X-Content-Type-Options", "nosniff");
  response->keep_alive(asked.keep_alive());
  if (head) response->content_length(answer.body.size());
  else response->body() = answer.body;
  if (!head) response->prepare_payload();
  http::async_write(stream_, *response, [self = shared_from_this(), response](const error_code& failed, std::size_t) {
    if (!failed && response->keep_alive()) self->read_request();
  });
}

void Server::Implementation::Page::open_socket() {
  stream_.expires_never();
  stream_.socket().set_option(tcp::no_delay(true));
  socket_.emplace(std::move(stream_));
  socket_->set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
  socket_->read_message_max(longest_ask);
  socket_->auto_fragment(false);  // a picture is one frame, not thousands of 4 KB
  socket_->async_accept(parser_->get(), [self = shared_from_this()](const error_code& error) {
    if (error) return;
    self->server_.join(self);
    self->read_ask();
  });
}

void Server::Implementation::Page::read_ask() {
  socket_->async_read(buffer_, [self = shared_from_this()](const error_code& error, std::size_t) {
    if (error) return self->server_.leave(self);
    std::string ask = beast::buffers_to_string(self->buffer_.data());
    self->buffer_.consume(self->buffer_.size());
    if (ask == "drawn") {
      self->server_.drawn(*self);
    } else {
      self->server_.asked_(std::move(ask));
    }
    self->read_ask();
  });
}

void Server::Implementation::Page::send(Message bytes, bool binary) {
  // A page that takes nothing any more is closed, before it holds all memory.
  if (outgoing_.size() >= longest_backlog) return close();
  outgoing_.push_back({std::move(bytes), binary});
  if (outgoing_.size() == 1) write();
}

void Server::Implementation::Page::write() {
  socket_->binary(outgoing_.front().binary);
  socket_->async_write(asio::buffer(*outgoing_.front().bytes),
                       [self = shared_from_this()](const error_code& error, std::size_t) {
                         if (error) return self->server_.leave(self);
                         self->outgoing_.pop_front();
                         if (!self->outgoing_.empty()) self->write();
                       });
}

void Server::Implementation::serve() {
  for (;;) {
    try {
      loop_.run();
      return;
    } catch (const std::exception& error) {
      // Of one page; the others go on.
      fmt::print(stderr, "decant: {}\n", error.what());
    }
  }
}

void Server::Implementation::accept() {
  acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      std::make_shared<Page>(std::move(socket), *this)->read_request();
      return accept();
    }
    // Without descriptors the next try would fail at once, and so on.
    pause_.expires_after(std::chrono::milliseconds(100));
    pause_.async_wait([this](const error_code& ended) {
      if (!ended) accept();
    });
  });
}

void Server::Implementation::join(const std::shared_ptr<Page>& page) {
  if (pages_.size() >= most_pages) return page->close();
  pages_.insert(page);
  for (const auto& [type, text] : last_) page->send(text, false);
  if (last_picture_) page->send_picture(last_picture_);
  count();
}

void Server::Implementation::leave(const std::shared_ptr<Page>& page) {
  pages_.erase(page);
  count();
}

void Server::Implementation::count() {
  int waiting = 0;
  for (const auto& page : pages_) waiting += page->drawn;
  waiting_ = waiting;
  looking_ = static_cast<int>(pages_.size());
}

void Server::Implementation::picture(Message bytes) {
  last_picture_ = bytes;
  for (const auto& page : std::set(pages_))
    if (page->drawn) page->send_picture(bytes);
  count();
}

/// A page that was slow gets what it has missed: there may be no other picture, as the run may be at rest.
void Server::Implementation::drawn(Page& page) {
  page.drawn = true;
  if (page.behind(last_picture_)) page.send_picture(last_picture_);
  count();
}

void Server::Implementation::tell(const std::string& type, Message text) {
  if (type == "scene") last_.erase("scores");
  if (type == "scene" || type == "status" || type == "scores") last_[type] = text;
  for (const auto& page : std::set(pages_)) page->send(text, false);
}

Server::Server(std::uint16_t port) : implementation_(std::make_unique<Implementation>(port)) {}

Server::~Server() { stop(); }

void Server::serve(std::function<void(std::string)> asked) { implementation_->start(std::move(asked)); }

void Server::stop() { implementation_->stop(); }

std::uint16_t Server::port() const { return implementation_->port_; }

std::string Server::address() const {
  return fmt::format("http://127.0.0.1:{}/{}/", port(), implementation_->requests_.token());
}

bool Server::watched() const { return implementation_->looking_ > 0; }

bool Server::wants_picture() const { return implementation_->waiting_ > 0; }

void Server::picture(Message bytes) {
  implementation_->waiting_ = 0;  // until it is known who has drawn this one
  asio::post(implementation_->loop(),
             [server = implementation_.get(), bytes = std::move(bytes)] { server->picture(bytes); });
}

void Server::tell(const nlohmann::ordered_json& message) {
  using nlohmann::ordered_json;
  // Names in a scene may be no UTF-8.
  auto text = std::make_shared<const std::string>(message.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
  asio::post(implementation_->loop(), [server = implementation_.get(), type = message.at("type").get<std::string>(),
                                       text = std::move(text)] { server->tell(type, text); });
}

}  // namespace decant::live
