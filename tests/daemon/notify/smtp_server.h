#pragma once
// A mail server of one thread on loopback, which says what it is told to.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace cellcal::daemon::testing {

class SmtpServer {
 public:
  struct Parts {
    ::SSL_CTX* tls = nullptr;
    bool from_the_first_byte = false;  ///< else where STARTTLS asks for it
    /// What it answers to a line that begins so, in place of the usual; "": nothing any more.
    std::map<std::string, std::string> answers = {};
  };

  explicit SmtpServer(Parts parts)
      : parts_(std::move(parts)), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
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
  ~SmtpServer() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  SmtpServer(const SmtpServer&) = delete;
  SmtpServer& operator=(const SmtpServer&) = delete;

  const std::string& port() const { return port_; }
  /// All lines, without \r\n; those that came over TLS begin with "tls ".
  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  bool heard(const std::string& line) {
    for (const std::string& one : lines()) {
      if (one == line) return true;
    }
    return false;
  }

 private:
  struct Line {
    int fd;
    ::SSL* ssl = nullptr;
    std::string buffer = {};

    bool shake(::SSL_CTX* tls) {
      ssl = ::SSL_new(tls);
      ::SSL_set_fd(ssl, fd);
      return ::SSL_accept(ssl) == 1;
    }
    void say(const std::string& text) {
      const std::string all = text + "\r\n";
      if (ssl != nullptr) {
        ::SSL_write(ssl, all.data(), static_cast<int>(all.size()));
      } else {
        ::send(fd, all.data(), all.size(), MSG_NOSIGNAL);
      }
    }
    bool hear(std::string& line) {
      std::size_t end = 0;
      while ((end = buffer.find("\r\n")) == std::string::npos) {
        char bytes[4096];
        const long got = ssl != nullptr ? ::SSL_read(ssl, bytes, sizeof bytes)
                                        : ::recv(fd, bytes, sizeof bytes, 0);
        if (got <= 0) return false;
        buffer.append(bytes, static_cast<std::size_t>(got));
      }
      line = buffer.substr(0, end);
      buffer.erase(0, end + 2);
      return true;
    }
    ~Line() {
      if (ssl != nullptr) ::SSL_free(ssl);
      ::close(fd);
    }
  };

  void serve() {
    for (int fd = ::accept(listener_, nullptr, nullptr); fd >= 0;
         fd = ::accept(listener_, nullptr, nullptr)) {
      Line line{fd};
      if (parts_.from_the_first_byte && !line.shake(parts_.tls)) continue;
      talk(line);
    }
  }

  void talk(Line& line) {
    line.say("220 mail.example ESMTP");
    bool data = false;
    for (std::string text; line.hear(text);) {
      {
        const std::lock_guard lock(mutex_);
        lines_.push_back((line.ssl != nullptr ? "tls " : "") + text);
      }
      if (data && text != ".") continue;
      data = false;
      const std::string* other = nullptr;
      for (const auto& [begin, answer] : parts_.answers) {
        if (text.starts_with(begin)) other = &answer;
      }
      if (other != nullptr) {
        if (other->empty()) {
          line.hear(text);  // until who asked goes away
          return;
        }
        line.say(*other);
      } else if (text.starts_with("EHLO")) {
        const bool offers = parts_.tls != nullptr && line.ssl == nullptr;
        line.say(std::string("250-mail.example\r\n") + (offers ? "250-STARTTLS\r\n" : "") +
                 "250 AUTH PLAIN");
      } else if (text == "STARTTLS") {
        line.say("220 go on");
        if (!line.shake(parts_.tls)) return;
      } else if (text.starts_with("AUTH PLAIN")) {
        line.say(text == "AUTH PLAIN" ? "334 " : "235 known");
      } else if (text == "DATA") {
        data = true;
        line.say("354 go on");
      } else if (text == "QUIT") {
        line.say("221 bye");
        return;
      } else {
        line.say(text.find(' ') == std::string::npos && text != "." ? "235 known" : "250 taken");
      }
    }
  }

  Parts parts_;
  int listener_;
  std::string port_;
  std::mutex mutex_;
  std::vector<std::string> lines_;
  std::thread thread_;
};

}  // namespace cellcal::daemon::testing
