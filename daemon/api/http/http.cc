#include "daemon/api/http/http.h"

#include <boost/asio/io_context.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include "daemon/api/http/unix_listener.h"

namespace cellcal::daemon {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Local = asio::local::stream_protocol;

/// Reports and calibrations of hundreds of touches are a few megabytes.
constexpr std::uint64_t kMostAnswer = 256u << 20;
/// sun_path holds 108 bytes including the terminator.
constexpr std::size_t kLongestPath = 107;

}  // namespace

Local::endpoint endpoint_of(const std::filesystem::path& socket) {
  if (socket.empty() || socket.string().size() > kLongestPath) {
    throw SocketError("socket path \"" + socket.string() + "\" must have 1 to 107 characters");
  }
  return Local::endpoint(socket.string());
}

Response http_request(const std::filesystem::path& socket, const std::string& method,
                      const std::string& target, const std::string& body,
                      std::chrono::milliseconds most) {
  asio::io_context context;
  beast::basic_stream<Local> peer(context);
  beast::error_code code;
  peer.socket().connect(endpoint_of(socket), code);
  if (code == asio::error::access_denied) {
    throw SocketPermissionError(
        "no permission for " + socket.string() +
        ". Add yourself to the group: sudo adduser \"$USER\" cellcal, then log in again");
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
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMostAnswer);
  if (most.count() > 0) peer.expires_after(most);
  http::async_write(peer, request, [&](beast::error_code failed, std::size_t) {
    code = failed;
    if (code) return;
    http::async_read(peer, buffer, parser,
                     [&](beast::error_code unread, std::size_t) { code = unread; });
  });
  context.run();
  if (code) {
    throw SocketError("cellcald on " + socket.string() + " did not answer: " + code.message() +
                      "; see its log");
  }
  auto message = parser.release();
  return {static_cast<int>(message.result_int()), std::string(message[http::field::content_type]),
          std::move(message.body())};
}

}  // namespace cellcal::daemon
