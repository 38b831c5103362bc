#include "daemon/api/http.h"

#include <sys/stat.h>

#include <algorithm>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <condition_variable>
#include <deque>
#include <list>
#include <mutex>
#include <thread>

namespace cellcal::daemon {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Local = asio::local::stream_protocol;
using Stream = beast::basic_stream<Local, asio::any_io_executor>;

constexpr std::uint64_t kMostBody = 64 * 1024;
constexpr std::uint32_t kMostHeader = 8 * 1024;
/// Reports and calibrations of hundreds of touches are a few megabytes.
constexpr std::uint64_t kMostAnswer = 256u << 20;
constexpr std::size_t kMostConnections = 64;
/// From the connection, or the answer before, until the request is there as a whole.
constexpr std::chrono::seconds kLongestRequest{5};
constexpr std::chrono::seconds kLongestAnswer{30};
/// A waiting answer is given by then, so that a client can tell a quiet daemon from a dead one.
constexpr std::chrono::seconds kLongestWait{20};
constexpr mode_t kSocketMode = 0660;
/// sun_path holds 108 bytes with its zero.
constexpr std::size_t kLongestPath = 107;

Local::endpoint endpoint_of(const std::filesystem::path& socket) {
  if (socket.empty() || socket.string().size() > kLongestPath) {
    throw SocketError("socket path \"" + socket.string() + "\" must have 1 to 107 characters");
  }
  return Local::endpoint(socket.string());
}

/// A socket file may be a dead daemon's, a living one's, or no socket at all.
void make_way(asio::io_context& context, const std::filesystem::path& socket) {
  struct stat info {};
  if (::lstat(socket.c_str(), &info) != 0) return;
  if (!S_ISSOCK(info.st_mode)) {
    throw SocketError(socket.string() +
                      " exists and is no socket. Remove it, or set another socket");
  }
  Local::socket probe(context);
  beast::error_code code;
  probe.connect(endpoint_of(socket), code);
  if (!code) {
    throw SocketError("another cellcald listens on " + socket.string() +
                      ". Stop it first, or set another socket");
  }
  if (code != asio::error::connection_refused) {
    throw SocketError(socket.string() + ": " + code.message());
  }
  std::filesystem::remove(socket);
}

class Connection;

/// One thread for requests that take their time.
class Clerk {
 public:
  Clerk() : thread_([this] { run(); }) {}
  ~Clerk() { stop(); }
  Clerk(const Clerk&) = delete;
  Clerk& operator=(const Clerk&) = delete;

  /// False: too many wait already.
  bool post(std::function<void()> job) {
    {
      const std::lock_guard lock(mutex_);
      if (jobs_.size() >= kMostConnections) return false;
      jobs_.push_back(std::move(job));
    }
    wake_.notify_one();
    return true;
  }
  /// Finishes the job in hand and drops the others.
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    wake_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
      if (ending_) return;
      const std::function<void()> job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      job();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> jobs_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace

struct HttpServer::Impl : std::enable_shared_from_this<HttpServer::Impl> {
  Impl(asio::io_context& io, std::filesystem::path path, Handler handle, Slow is_slow)
      : context(io),
        socket(std::move(path)),
        handler(std::move(handle)),
        slow(std::move(is_slow)),
        acceptor(io) {}

  void listen();
  void accept();
  void make_room();

  asio::io_context& context;
  std::filesystem::path socket;
  Handler handler;
  Slow slow;
  Local::acceptor acceptor;
  std::list<std::shared_ptr<Connection>> connections;  ///< the oldest first
  bool stopped = false;
  Clerk clerk;
};

namespace {

/// One client: reads a request, waits for its answer, writes it, and so on.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Local::socket socket, std::weak_ptr<HttpServer::Impl> server)
      : stream_(std::move(socket)), timer_(stream_.get_executor()), server_(std::move(server)) {}

  /// What it waits for, the least to be missed first.
  enum class Waits { kForRequest, kForChange, kForClerk, kForReader };
  Waits waits() const { return waits_; }

  void read() {
    waits_ = Waits::kForRequest;
    parser_.emplace();
    parser_->body_limit(kMostBody);
    parser_->header_limit(kMostHeader);
    stream_.expires_after(kLongestRequest);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](beast::error_code code, std::size_t) { self->on_read(code); });
  }

  /// Gives the answer if there is one by now.
  void ask(bool give_up) {
    const auto server = server_.lock();
    if (waits_ != Waits::kForChange || !server) return;
    std::optional<Response> answer = server->handler(request_, give_up);
    if (!answer && !give_up) return;
    timer_.cancel();
    write(std::move(answer), keep_);
  }

  void close() {
    const auto self = shared_from_this();
    timer_.cancel();
    beast::error_code ignored;  // the peer may be gone already
    stream_.socket().shutdown(Local::socket::shutdown_both, ignored);
    stream_.close();
    if (const auto server = server_.lock()) server->connections.remove(self);
  }

 private:
  void on_read(beast::error_code code) {
    if (code == http::error::body_limit) {
      return refuse(413, "the body is longer than 64 KiB");
    }
    if (code == http::error::header_limit) {
      return refuse(431, "the header is longer than 8 KiB");
    }
    const bool malformed =
        code.category() == http::make_error_code(http::error::bad_method).category() &&
        code != http::error::end_of_stream && code != http::error::partial_message;
    if (malformed) return refuse(400, "this is not HTTP: " + code.message());
    if (code) return close();
    auto message = parser_->release();
    keep_ = message.keep_alive();
    request_ = parse_target(std::string(message.method_string()), std::string(message.target()),
                            std::move(message.body()));
    stream_.expires_never();
    const auto server = server_.lock();
    if (server && server->slow && server->slow(request_)) return ask_clerk(*server);
    waits_ = Waits::kForChange;
    timer_.expires_after(kLongestWait);
    timer_.async_wait([self = shared_from_this()](beast::error_code cancelled) {
      if (!cancelled) self->ask(true);
    });
    ask(false);
  }

  void ask_clerk(HttpServer::Impl& server) {
    waits_ = Waits::kForClerk;
    const bool taken = server.clerk.post([self = shared_from_this(), &server] {
      auto answer = server.handler(self->request_, true);
      asio::post(server.context, [self, answer = std::move(answer)]() mutable {
        if (self->stream_.socket().is_open()) self->write(std::move(answer), self->keep_);
      });
    });
    if (!taken)
      refuse(503, "too many requests are waiting. Try again; status and abort are still answered");
  }

  void refuse(int status, const std::string& words) {
    write(Response{status, "application/json", "{\"error\":\"" + words + "\"}"}, false);
  }

  void write(std::optional<Response> given, bool keep) {
    waits_ = Waits::kForReader;
    Response response =
        given ? std::move(*given) : Response{500, "application/json", "{\"error\":\"no answer\"}"};
    answer_ = http::response<http::string_body>(static_cast<http::status>(response.status), 11);
    answer_.set(http::field::server, "cellcald");
    answer_.set(http::field::content_type, response.type);
    answer_.set("X-Content-Type-Options", "nosniff");
    answer_.body() = std::move(response.body);
    answer_.keep_alive(keep);
    answer_.prepare_payload();
    stream_.expires_after(kLongestAnswer);
    http::async_write(stream_, answer_,
                      [self = shared_from_this(), keep](beast::error_code code, std::size_t) {
                        if (code || !keep) return self->close();
                        self->read();
                      });
  }

  Stream stream_;
  asio::steady_timer timer_;
  std::weak_ptr<HttpServer::Impl> server_;
  beast::flat_buffer buffer_{kMostBody + kMostHeader};
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> answer_;
  Request request_;
  Waits waits_ = Waits::kForRequest;
  bool keep_ = false;
};

}  // namespace

void HttpServer::Impl::listen() {
  make_way(context, socket);
  beast::error_code code;
  acceptor.open(Local());
  // Created with the final mode: between bind and chmod nobody else may slip in.
  const mode_t before = ::umask(static_cast<mode_t>(~kSocketMode & 0777));
  acceptor.bind(endpoint_of(socket), code);
  ::umask(before);
  if (!code) acceptor.listen(asio::socket_base::max_listen_connections, code);
  if (code) {
    throw SocketError("cannot listen on " + socket.string() + ": " + code.message() +
                      ". Check that its directory exists and is writable");
  }
}

/// There is always room for one more, who may want to stop the arm: of those that wait for what is
/// least to be missed the oldest has to go.
void HttpServer::Impl::make_room() {
  if (connections.size() < kMostConnections) return;
  const auto least =
      std::min_element(connections.begin(), connections.end(),
                       [](const auto& a, const auto& b) { return a->waits() < b->waits(); });
  const std::shared_ptr<Connection> gone = *least;
  gone->close();
}

void HttpServer::Impl::accept() {
  acceptor.async_accept([self = shared_from_this()](beast::error_code code, Local::socket peer) {
    if (self->stopped || code == asio::error::operation_aborted) return;
    if (!code) {
      self->make_room();
      auto connection = std::make_shared<Connection>(std::move(peer), self);
      self->connections.push_back(connection);
      connection->read();
    }
    if (!code) return self->accept();
    // Out of descriptors, most likely: trying at once would only burn the processor.
    auto pause = std::make_shared<asio::steady_timer>(self->context, std::chrono::seconds(1));
    pause->async_wait([self, pause](beast::error_code) {
      if (!self->stopped) self->accept();
    });
  });
}

HttpServer::HttpServer(asio::io_context& context, const std::filesystem::path& socket,
                       Handler handler, Slow slow)
    : impl_(std::make_shared<Impl>(context, socket, std::move(handler), std::move(slow))) {
  impl_->listen();
  impl_->accept();
}

HttpServer::~HttpServer() { stop(); }

void HttpServer::poke() {
  asio::post(impl_->context, [weak = std::weak_ptr<Impl>(impl_)] {
    const auto impl = weak.lock();
    if (!impl) return;
    const auto connections = impl->connections;  // an answer may end its connection
    for (const auto& connection : connections) connection->ask(false);
  });
}

void HttpServer::stop() {
  if (impl_->stopped) return;
  impl_->stopped = true;
  beast::error_code ignored;  // it is going away either way
  impl_->acceptor.close(ignored);
  const auto connections = impl_->connections;
  for (const auto& connection : connections) connection->close();
  impl_->clerk.stop();
  std::error_code gone;  // removed by someone else: what was wanted
  std::filesystem::remove(impl_->socket, gone);
}

Response http_request(const std::filesystem::path& socket, const std::string& method,
                      const std::string& target, const std::string& body) {
  asio::io_context context;
  Local::socket peer(context);
  beast::error_code code;
  peer.connect(endpoint_of(socket), code);
  if (code == asio::error::access_denied) {
    throw SocketPermissionError(
        "no permission for " + socket.string() +
        ". Add yourself to the group: sudo adduser \"$USER\" cellcal, then log "
        "in again");
  }
  if (code) {
    throw SocketError("no cellcald answers on " + socket.string() + " (" + code.message() +
                      "). Start it (sudo systemctl start cellcald), or give its socket with "
                      "--socket");
  }
  http::request<http::string_body> request(http::string_to_verb(method), target, 11);
  request.set(http::field::host, "cellcald");
  request.set(http::field::content_type, "application/json");
  request.keep_alive(false);
  request.body() = body;
  request.prepare_payload();
  http::write(peer, request, code);
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMostAnswer);
  if (!code) http::read(peer, buffer, parser, code);
  if (code) {
    throw SocketError("cellcald on " + socket.string() + " did not answer: " + code.message() +
                      "; see its log");
  }
  auto message = parser.release();
  return {static_cast<int>(message.result_int()), std::string(message[http::field::content_type]),
          std::move(message.body())};
}

}  // namespace cellcal::daemon
