#pragma once
// A server on loopback that keeps the requests it is sent and answers as it is told to.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace cellcal::daemon::testing {

class HookServer {
 public:
  /// Each request has the next of these answers, the last one for ever; empty: none, the line stays open.
  explicit HookServer(std::deque<std::string> answers, ::SSL_CTX* tls = nullptr)
      : answers_(std::move(answers)),
        tls_(tls),
        listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 8), 0);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = std::to_string(ntohs(address.sin_port));
    thread_ = std::thread([this] { serve(); });
  }
  ~HookServer() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
    for (const int fd : held_) ::close(fd);
  }
  HookServer(const HookServer&) = delete;
  HookServer& operator=(const HookServer&) = delete;

  const std::string& port() const { return port_; }
  std::vector<std::string> requests() {
    const std::lock_guard lock(mutex_);
    return requests_;
  }

 private:
  void serve() {
    for (int fd = ::accept(listener_, nullptr, nullptr); fd >= 0;
         fd = ::accept(listener_, nullptr, nullptr)) {
      ::SSL* ssl = nullptr;
      if (tls_ != nullptr) {
        ssl = ::SSL_new(tls_);
        ::SSL_set_fd(ssl, fd);
        if (::SSL_accept(ssl) != 1) {
          ::SSL_free(ssl);
          ::close(fd);
          continue;
        }
      }
      const std::string request = read(fd, ssl);
      std::string answer;
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
        answer = answers_.front();
        if (answers_.size() > 1) answers_.pop_front();
      }
      if (answer.empty()) {
        held_.push_back(fd);
        continue;
      }
      if (ssl != nullptr) {
        ::SSL_write(ssl, answer.data(), static_cast<int>(answer.size()));
        ::SSL_shutdown(ssl);
        ::SSL_free(ssl);
      } else {
        ::send(fd, answer.data(), answer.size(), MSG_NOSIGNAL);
      }
      ::close(fd);
    }
  }

  /// Head and as much body as it states.
  static std::string read(int fd, ::SSL* ssl) {
    std::string text;
    char bytes[4096];
    while (true) {
      const std::size_t head = text.find("\r\n\r\n");
      if (head != std::string::npos) {
        const std::size_t at = text.find("Content-Length: ");
        const std::size_t body = at < head ? std::stoul(text.substr(at + 16)) : 0;
        if (text.size() >= head + 4 + body) return text;
      }
      const long got = ssl != nullptr ? ::SSL_read(ssl, bytes, sizeof bytes)
                                      : ::recv(fd, bytes, sizeof bytes, 0);
      if (got <= 0) return text;
      text.append(bytes, static_cast<std::size_t>(got));
    }
  }

  std::deque<std::string> answers_;
  ::SSL_CTX* tls_;
  int listener_;
  std::string port_;
  std::mutex mutex_;
  std::vector<std::string> requests_;
  std::vector<int> held_;
  std::thread thread_;
};

inline const std::string kTaken = "HTTP/1.1 204 No Content\r\nContent-Length: 0\r\n\r\n";
inline const std::string kBroken = "HTTP/1.1 503 Busy\r\nContent-Length: 0\r\n\r\n";
inline const std::string kRefused = "HTTP/1.1 404 None\r\nContent-Length: 0\r\n\r\n";

}  // namespace cellcal::daemon::testing
