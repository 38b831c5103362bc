// Listener on a Unix socket; access is controlled by the file system.

#include <sys/stat.h>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/basic_socket_acceptor.hpp>
#include <boost/asio/local/stream_protocol.hpp>

#include "daemon/api/http/connection_on.h"

namespace cellcal::daemon {

namespace {

using Local = asio::local::stream_protocol;
using LocalStream = beast::basic_stream<Local, asio::any_io_executor>;

constexpr mode_t kSocketMode = 0660;

/// An existing socket file may belong to a dead or a running daemon, or be no socket at all.
void remove_stale_socket(asio::io_context& context, const std::filesystem::path& socket) {
  struct stat info {};
  if (::lstat(socket.c_str(), &info) != 0) return;
  if (!S_ISSOCK(info.st_mode)) {
    throw SocketError(socket.string() +
                      " exists and is not a socket. Remove it, or set another socket");
  }
  Local::socket probe(context);
  beast::error_code code;
  probe.connect(socket.string(), code);
  if (!code) {
    throw SocketError("another cellcald listens on " + socket.string() +
                      ". Stop it first, or set another socket");
  }
  if (code != asio::error::connection_refused) {
    throw SocketError(socket.string() + ": " + code.message());
  }
  std::filesystem::remove(socket);
}

class UnixListener final : public HttpServer::Impl {
 public:
  UnixListener(asio::io_context& io, std::filesystem::path path, ServerParts given)
      : Impl(io, std::move(given)), socket_(std::move(path)), acceptor_(io) {
    require_socket_path(socket_);
    remove_stale_socket(io, socket_);
    beast::error_code code;
    acceptor_.open(Local());
    // Created with its final mode: no window between bind and chmod.
    const mode_t before = ::umask(static_cast<mode_t>(~kSocketMode & 0777));
    acceptor_.bind(socket_.string(), code);
    ::umask(before);
    if (!code) acceptor_.listen(asio::socket_base::max_listen_connections, code);
    if (code) {
      throw SocketError("cannot listen on " + socket_.string() + ": " + code.message() +
                        ". Check that its directory exists and is writable");
    }
  }

  void accept() override {
    acceptor_.async_accept(
        [self = shared_from_this(), this](beast::error_code code, Local::socket peer) {
          if (stopped || code == asio::error::operation_aborted) return;
          if (code) return accept_later();
          add(std::make_shared<ConnectionOn<LocalStream>>(LocalStream(std::move(peer)), "",
                                                          weak_from_this()));
          accept();
        });
  }

  void stop_listening() override {
    beast::error_code ignored;  // the connection is closed in any case
    acceptor_.close(ignored);
    std::error_code gone;  // already removed by another process
    std::filesystem::remove(socket_, gone);
  }

 private:
  std::filesystem::path socket_;
  Local::acceptor acceptor_;
};

}  // namespace

std::shared_ptr<HttpServer::Impl> listen_on(asio::io_context& context,
                                            const std::filesystem::path& socket,
                                            ServerParts parts) {
  return std::make_shared<UnixListener>(context, socket, std::move(parts));
}

}  // namespace cellcal::daemon
