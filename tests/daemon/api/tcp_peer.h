#pragma once
// A TCP client that sends bytes unmodified.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <utility>

namespace cellcal::daemon::testing {

class TcpPeer {
 public:
  explicit TcpPeer(std::uint16_t port, const std::string& bytes = "", int receive_buffer = 0)
      : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_buffer > 0) {
      ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    if (!bytes.empty()) send(bytes);
  }
  ~TcpPeer() {
    if (fd_ >= 0) ::close(fd_);
  }
  TcpPeer(TcpPeer&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), connected_(other.connected_) {}

  bool connected() const { return connected_; }
  bool send(const std::string& bytes) {
    return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  void end_sending() { ::shutdown(fd_, SHUT_WR); }
  /// Reads until `wanted` is received, or the server closes.
  std::string read_until(const std::string& wanted) {
    char buffer[4096];
    while (wanted.empty() || read_.find(wanted) == std::string::npos) {
      const ssize_t got = ::recv(fd_, buffer, sizeof buffer, 0);
      if (got <= 0) break;
      read_.append(buffer, static_cast<std::size_t>(got));
    }
    return read_;
  }
  /// Reads until this many bytes are received, or the server closes.
  std::string read_bytes(std::size_t least) {
    std::string buffer(65536, '\0');
    while (read_.size() < least) {
      const ssize_t got = ::recv(fd_, buffer.data(), buffer.size(), 0);
      if (got <= 0) break;
      read_.append(buffer, 0, static_cast<std::size_t>(got));
    }
    return read_;
  }
  std::string read_all() { return read_until(""); }
  /// True if the server neither closed it nor sent unread data.
  bool is_open_and_quiet() const {
    pollfd one{fd_, POLLIN, 0};
    return ::poll(&one, 1, 0) == 0;
  }

 private:
  int fd_;
  bool connected_ = false;
  std::string read_;
};

}  // namespace cellcal::daemon::testing
