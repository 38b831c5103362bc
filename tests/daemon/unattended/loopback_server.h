#pragma once
// Common parts of the tests' servers on loopback: a listener with a thread, a connection with or without
// TLS, and a self-signed certificate for "localhost".

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>
#include <thread>

#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {

/// An accepted connection, closed on destruction.
class LoopbackLine {
 public:
  explicit LoopbackLine(int fd) : fd_(fd) {}
  ~LoopbackLine() {
    if (ssl_ != nullptr) ::SSL_free(ssl_);
    ::close(fd_);
  }
  LoopbackLine(const LoopbackLine&) = delete;
  LoopbackLine& operator=(const LoopbackLine&) = delete;

  bool encrypted() const { return ssl_ != nullptr; }
  /// Starts TLS; false: refused by the client.
  bool encrypt(::SSL_CTX* tls) {
    ssl_ = ::SSL_new(tls);
    ::SSL_set_fd(ssl_, fd_);
    return ::SSL_accept(ssl_) == 1;
  }
  void send(std::string_view text) {
    if (ssl_ != nullptr) {
      ::SSL_write(ssl_, text.data(), static_cast<int>(text.size()));
    } else {
      ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
    }
  }
  /// Waits for more; false: the client has disconnected.
  bool receive(std::string& text) {
    char bytes[4096];
    const long got = ssl_ != nullptr ? ::SSL_read(ssl_, bytes, sizeof bytes)
                                     : ::recv(fd_, bytes, sizeof bytes, 0);
    if (got > 0) text.append(bytes, static_cast<std::size_t>(got));
    return got > 0;
  }

 private:
  int fd_;
  ::SSL* ssl_ = nullptr;
};

/// Serves one connection at a time.
class LoopbackServer {
 public:
  using Talk = std::function<void(LoopbackLine&)>;

  explicit LoopbackServer(Talk talk)
      : talk_(std::move(talk)), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    // OpenSSL writes without MSG_NOSIGNAL; a client that refuses a certificate has gone by then.
    std::signal(SIGPIPE, SIG_IGN);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 8), 0);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = std::to_string(ntohs(address.sin_port));
    thread_ = std::thread([this] {
      for (int fd = ::accept(listener_, nullptr, nullptr); fd >= 0;
           fd = ::accept(listener_, nullptr, nullptr)) {
        LoopbackLine line(fd);
        talk_(line);
      }
    });
  }
  ~LoopbackServer() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  LoopbackServer(const LoopbackServer&) = delete;
  LoopbackServer& operator=(const LoopbackServer&) = delete;

  const std::string& port() const { return port_; }

 private:
  Talk talk_;
  int listener_;
  std::string port_;
  std::thread thread_;
};

/// A server's key with a certificate for "localhost" that is trusted through `certificate()` only.
class SelfSigned {
 public:
  SelfSigned() {
    const std::string command =
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost "
        "-addext subjectAltName=DNS:localhost -out " +
        certificate().string() + " -keyout " + (dir_ / "k.pem").string() + " 2>/dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0);
    ::SSL_CTX_use_certificate_file(context_, certificate().c_str(), SSL_FILETYPE_PEM);
    ::SSL_CTX_use_PrivateKey_file(context_, (dir_ / "k.pem").c_str(), SSL_FILETYPE_PEM);
  }
  ~SelfSigned() { ::SSL_CTX_free(context_); }
  SelfSigned(const SelfSigned&) = delete;
  SelfSigned& operator=(const SelfSigned&) = delete;

  std::filesystem::path certificate() const { return dir_ / "c.pem"; }
  ::SSL_CTX* context() const { return context_; }

 private:
  TemporaryDirectory dir_;
  ::SSL_CTX* context_ = ::SSL_CTX_new(TLS_server_method());
};

}  // namespace cellcal::daemon::testing
