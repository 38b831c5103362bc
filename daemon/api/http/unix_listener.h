#pragma once
// Where a Unix socket is.

#include <boost/asio/local/stream_protocol.hpp>
#include <filesystem>

namespace cellcal::daemon {

/// Throws SocketError where the path is too long for one.
boost::asio::local::stream_protocol::endpoint endpoint_of(const std::filesystem::path& socket);

}  // namespace cellcal::daemon
