#pragma once
// Connection of one client, for any socket type: reads a request, waits for its answer, writes it, and
// repeats. Instantiated in one file per socket type, since Beast and Asio compile slowly.

#include <fmt/chrono.h>

#include <algorithm>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <ctime>
#include <limits>
#include <optional>
#include <string>

#include "calib/files/text.h"
#include "calib/model/long_work.h"
#include "daemon/api/http/server_impl.h"

namespace cellcal::daemon {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;

inline constexpr std::uint32_t kMostHeader = 8 * 1024;
/// Deadline of a pending answer, so that a client can distinguish a quiet daemon from a dead one.
inline constexpr std::chrono::seconds kLongestWait{20};
/// Time for a client whose request was refused midway to read the reason.
inline constexpr std::chrono::seconds kFarewellTimeout{2};

template <class Stream>
struct IsTls : std::false_type {};
template <class Next>
struct IsTls<beast::ssl_stream<Next>> : std::true_type {};

template <class SocketStream>
class ConnectionOn final : public Connection,
                           public std::enable_shared_from_this<ConnectionOn<SocketStream>> {
 public:
  ConnectionOn(SocketStream stream, std::string peer, std::weak_ptr<HttpServer::Impl> server)
      : Connection(std::move(peer)),
        stream_(std::move(stream)),
        timer_(stream_.get_executor()),
        limits_(server.lock()->parts.limits),
        server_(std::move(server)) {}

  void start() override {
    if constexpr (IsTls<SocketStream>::value) {
      lowest().expires_after(limits_.request);
      stream_.async_handshake(asio::ssl::stream_base::server,
                              [self = this->shared_from_this()](beast::error_code code) {
                                if (code) return self->close();
                                self->read();
                              });
    } else {
      read();
    }
  }

  void ask(bool give_up) override {
    if (waits_ == Waits::kForEvents) return give();
    const auto server = server_.lock();
    if (waits_ != Waits::kForChange || !server) return;
    std::optional<Response> answer = server->parts.handler(request_, give_up);
    if (!answer && !give_up) return;
    timer_.cancel();
    write(std::move(answer), keep_);
  }

  void close() override {
    const auto self = this->shared_from_this();
    timer_.cancel();
    beast::error_code ignored;  // the peer may have disconnected
    lowest().socket().shutdown(asio::socket_base::shutdown_both, ignored);
    lowest().close();
    events_.reset();
    if (const auto server = server_.lock()) server->remove(self);
  }

 private:
  auto& lowest() { return beast::get_lowest_layer(stream_); }

  void read() {
    waits_ = Waits::kForRequest;
    parser_.emplace();
    parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // until the header is known
    parser_->header_limit(kMostHeader);
    lowest().expires_after(limits_.request);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = this->shared_from_this()](beast::error_code code, std::size_t) {
                              code ? self->on_read(code) : self->read_body();
                            });
  }

  void read_body() {
    most_body_ = limits_.body;
    const std::uint64_t length = parser_->content_length().value_or(0);
    if (length > limits_.body) {
      const auto server = server_.lock();
      if (!server) return close();
      Request head = head_of(parser_->get());
      const auto& largest = server->parts.largest_body;
      if (largest) most_body_ = std::max(most_body_, largest(head));
      if (length > most_body_) return on_read(http::error::body_limit);
      keep_ = false;  // of a refusal, which leaves the body unread
      if (auto refusal = server->parts.admit(head)) return delay_answer(std::move(*refusal));
      lowest().expires_after(limits_.upload);
    }
    parser_->body_limit(most_body_);
    http::async_read(stream_, buffer_, *parser_,
                     [self = this->shared_from_this()](beast::error_code code, std::size_t) {
                       self->on_read(code);
                     });
  }

  void on_read(beast::error_code code) {
    if (code == http::error::body_limit)
      return refuse(413, "the body is longer than " + std::to_string(most_body_ >> 10) + " KiB");
    if (code == http::error::header_limit) return refuse(431, "the header is longer than 8 KiB");
    const bool malformed =
        code.category() == http::make_error_code(http::error::bad_method).category() &&
        code != http::error::end_of_stream && code != http::error::partial_message;
    if (malformed) return refuse(400, "this is not HTTP: " + code.message());
    if (code) return close();
    if (const std::string twice = adopt_request(); !twice.empty())
      return refuse(400, "there are two headers " + twice + ". Send it once");
    lowest().expires_never();
    const auto server = server_.lock();
    if (!server) return close();
    if (auto refusal = server->parts.admit(request_)) return delay_answer(std::move(*refusal));
    if (server->parts.slow && server->parts.slow(request_)) return ask_clerk(*server);
    waits_ = Waits::kForChange;
    timer_.expires_after(kLongestWait);
    timer_.async_wait([self = this->shared_from_this()](beast::error_code cancelled) {
      if (!cancelled) self->ask(true);
    });
    ask(false);
  }

  /// Returns the name of a duplicated header that affects authentication or routing, since a proxy in front
  /// may have evaluated the other copy.
  std::string adopt_request() {
    auto message = parser_->release();
    keep_ = message.keep_alive();
    std::string twice;
    request_ = head_of(message, &twice);
    request_.body = std::move(message.body());
    taken_ = std::chrono::steady_clock::now();
    return twice;
  }

  /// The request without its body. `twice`: see adopt_request().
  Request head_of(const http::request<http::string_body>& message,
                  std::string* twice = nullptr) const {
    Request request =
        parse_target(std::string(message.method_string()), std::string(message.target()), {});
    for (const auto& field : message) {
      std::string name = calib::lower_case(std::string(field.name_string()));
      const bool decides = name == "host" || name == "origin" || name == "authorization";
      if (decides && twice != nullptr && request.headers.contains(name)) *twice = name;
      request.headers.emplace(std::move(name), std::string(field.value()));
    }
    request.peer = this->peer();
    return request;
  }

  void ask_clerk(HttpServer::Impl& server) {
    waits_ = Waits::kForClerk;
    const auto job = [self = this->shared_from_this(), &server] {
      auto answer = self->make_slowly(server);
      auto held = server.answers.hold(answer.body.size());
      if (!held) answer = no_room();
      asio::post(server.context,
                 [self, answer = std::move(answer), held = std::move(held)]() mutable {
                   if (self->lowest().socket().is_open())
                     self->write(std::move(answer), self->keep_, std::move(held));
                 });
    };
    if (!server.clerk || !server.clerk->post(request_, job))
      write(busy("too many requests are waiting. Try again; status and abort are still answered"),
            false);
  }

  Response make_slowly(const HttpServer::Impl& server) const {
    // The sender of an acting request has given up by then, and may have entered the cell.
    if (is_stale()) return busy("request waited too long for others: nothing was done. Try again");
    // Reading requests are cancelled when the server stops; acting ones are completed.
    const bool reads = request_.method == "GET";
    const calib::Watch watch([&server, reads] { return reads && server.stopped; });
    try {
      return server.parts.handler(request_, true).value_or(error(500, "no answer"));
    } catch (const calib::Cancelled&) {
      return busy("the program ends");
    }
  }

  static Response no_room() {
    return busy("other clients have not read their answers yet. Ask again in a few seconds");
  }

  /// Delays a refusal to slow down guessing. The slot is available to others meanwhile.
  void delay_answer(Response refusal) {
    if (refusal.hold.count() == 0) return write(std::move(refusal), keep_);
    waits_ = Waits::kForRequest;
    timer_.expires_after(std::exchange(refusal.hold, {}));
    timer_.async_wait([self = this->shared_from_this(),
                       refusal = std::move(refusal)](beast::error_code cancelled) mutable {
      if (!cancelled) self->write(std::move(refusal), self->keep_);
    });
  }

  bool is_stale() const {
    return request_.is_from_network() && request_.method != "GET" &&
           std::chrono::steady_clock::now() - taken_ > limits_.queue;
  }

  void refuse(int status, const std::string& words) { write(error(status, words), false); }

  /// `held`: its bytes are already reserved.
  void write(std::optional<Response> given, bool keep, std::shared_ptr<void> held = {}) {
    waits_ = Waits::kForReader;
    Response response = given ? std::move(*given) : error(500, "no answer");
    if (response.hold.count() > 0) return delay_answer(std::move(response));
    if (response.stream) return follow(std::move(response));
    held_ = held ? std::move(held) : hold(response);
    if (!held_) response = no_room();
    answer_ = http::response<http::string_body>(static_cast<http::status>(response.status), 11);
    set_headers(answer_, response);
    answer_.body() = std::move(response.body);
    answer_.keep_alive(keep);
    answer_.prepare_payload();
    lowest().expires_after(limits_.answer);
    http::async_write(stream_, answer_,
                      [self = this->shared_from_this(), keep](beast::error_code code, std::size_t) {
                        self->answer_ = {};  // released before the next request is awaited
                        self->held_.reset();
                        if (code) return self->close();
                        keep ? self->read() : self->drain_and_close();
                      });
  }

  /// Null: no memory left.
  std::shared_ptr<void> hold(const Response& response) const {
    const auto server = server_.lock();
    return server ? server->answers.hold(response.body.size()) : nullptr;
  }

  template <class Message>
  static void set_headers(Message& message, const Response& response) {
    message.set(http::field::server, "cellcald");
    // Ages are stated by it where the client's clock is wrong.
    message.set(http::field::date,
                fmt::format("{:%a, %d %b %Y %H:%M:%S} GMT", fmt::gmtime(std::time(nullptr))));
    message.set(http::field::content_type, response.type);
    message.set("X-Content-Type-Options", "nosniff");
    message.set(http::field::cache_control, "no-store");  // unless overridden
    if constexpr (IsTls<SocketStream>::value)
      message.set(http::field::strict_transport_security, "max-age=2592000");  // 30 days
    for (const auto& [name, value] : response.headers) message.set(name, value);
  }

  void follow(Response response) {
    const auto server = server_.lock();
    if (!server) return close();
    if (!server->make_room_for_a_stream(request_.caller.name)) {
      return write(busy(std::to_string(kMostStreams) +
                        " clients follow already. Close one, or ask /v1/status"),
                   false);
    }
    caller_ = request_.caller.name;
    events_ = std::move(response.stream);
    http::response<http::empty_body> head(static_cast<http::status>(response.status), 11);
    set_headers(head, response);
    head.keep_alive(false);  // the body ends with the connection
    std::ostringstream text;
    text << head;
    chunk_ = text.str();
    waits_ = Waits::kForEvents;
    close_when_it_speaks();
    send_chunk();
    server->poll_streams();
  }

  /// One piece at a time is in flight; nothing is buffered for a slow reader.
  void give() {
    if (sending_ || !events_) return;
    std::optional<std::string> news = events_->next();
    if (!news) return close();
    if (news->empty()) return;
    chunk_ = std::move(*news);
    send_chunk();
  }

  void send_chunk() {
    sending_ = true;
    lowest().expires_after(limits_.follower);
    asio::async_write(stream_, asio::buffer(chunk_),
                      [self = this->shared_from_this()](beast::error_code code, std::size_t) {
                        self->sending_ = false;
                        if (code) return self->close();
                        self->lowest().expires_never();
                        self->give();
                      });
  }

  /// A follower sends nothing more; any input closes the connection.
  void close_when_it_speaks() {
    lowest().socket().async_wait(asio::socket_base::wait_read,
                                 [weak = this->weak_from_this()](beast::error_code code) {
                                   const auto self = weak.lock();
                                   if (self && !code) self->close();
                                 });
  }

  /// Closing with unread bytes would discard the answer of a client that is still sending.
  void drain_and_close() {
    waits_ = Waits::kForRequest;
    lowest().expires_after(kFarewellTimeout);
    if constexpr (IsTls<SocketStream>::value) {
      stream_.async_shutdown(
          [self = this->shared_from_this()](beast::error_code) { self->close(); });
    } else {
      beast::error_code ignored;  // the peer may have disconnected
      lowest().socket().shutdown(asio::socket_base::shutdown_send, ignored);
      drain();
    }
  }

  void drain() {
    chunk_.resize(4096);
    lowest().async_read_some(asio::buffer(chunk_), [self = this->shared_from_this()](
                                                       beast::error_code code, std::size_t) {
      if (code) return self->close();
      self->drain();
    });
  }

  SocketStream stream_;
  asio::steady_timer timer_;
  ServerLimits limits_;
  std::size_t most_body_ = limits_.body;  ///< of the current request [bytes]
  std::weak_ptr<HttpServer::Impl> server_;
  beast::flat_buffer buffer_{kMostBody + kMostHeader};
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> answer_;
  std::shared_ptr<void> held_;  ///< reserved bytes of the answer
  Request request_;
  std::chrono::steady_clock::time_point taken_{};  ///< time of complete reception
  std::shared_ptr<daemon::Stream> events_;
  std::string chunk_;
  bool keep_ = false, sending_ = false;
};

}  // namespace cellcal::daemon
