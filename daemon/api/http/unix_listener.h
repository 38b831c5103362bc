#pragma once
// Endpoint of a Unix socket.

#include <boost/asio/local/stream_protocol.hpp>
#include <filesystem>

namespace cellcal::daemon {

/// Throws SocketError where the path exceeds the limit.
boost::asio::local::stream_protocol::endpoint endpoint_of(const std::filesystem::path& socket);

}  // namespace cellcal::daemon
