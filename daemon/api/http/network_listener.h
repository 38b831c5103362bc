#pragma once
// Connections over TCP; one file per type.

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>

#include "daemon/api/http/server_impl.h"

namespace cellcal::daemon {

std::shared_ptr<Connection> plain_connection(boost::asio::ip::tcp::socket socket, std::string peer,
                                             std::weak_ptr<HttpServer::Impl> server);
std::shared_ptr<Connection> tls_connection(boost::asio::ip::tcp::socket socket, std::string peer,
                                           std::weak_ptr<HttpServer::Impl> server,
                                           boost::asio::ssl::context& tls);

}  // namespace cellcal::daemon
