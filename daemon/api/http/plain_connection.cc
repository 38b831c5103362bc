#include "daemon/api/http/connection_on.h"
#include "daemon/api/http/network_connection.h"

namespace cellcal::daemon {

std::shared_ptr<Connection> plain_connection(asio::ip::tcp::socket socket, std::string peer,
                                             std::weak_ptr<HttpServer::Impl> server) {
  return std::make_shared<ConnectionOn<beast::tcp_stream>>(beast::tcp_stream(std::move(socket)),
                                                           std::move(peer), std::move(server));
}

}  // namespace cellcal::daemon
