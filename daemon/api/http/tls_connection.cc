#include "daemon/api/http/connection_on.h"
#include "daemon/api/http/network_connection.h"

namespace cellcal::daemon {

std::shared_ptr<Connection> tls_connection(asio::ip::tcp::socket socket, std::string peer,
                                           std::weak_ptr<HttpServer::Impl> server,
                                           asio::ssl::context& tls) {
  using TlsStream = beast::ssl_stream<beast::tcp_stream>;
  return std::make_shared<ConnectionOn<TlsStream>>(
      TlsStream(beast::tcp_stream(std::move(socket)), tls), std::move(peer), std::move(server));
}

}  // namespace cellcal::daemon
