#pragma once
// A server on loopback that stores its requests and gives scripted answers.

#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "tests/daemon/unattended/loopback_server.h"

namespace cellcal::daemon::testing {

class HookServer {
 public:
  /// Each request gets the next of these answers, the last one repeatedly; empty: no answer, the connection
  /// stays open until the client closes it.
  explicit HookServer(std::deque<std::string> answers, ::SSL_CTX* tls = nullptr)
      : answers_(std::move(answers)), tls_(tls) {}

  const std::string& port() const { return server_.port(); }
  std::vector<std::string> requests() {
    const std::lock_guard lock(mutex_);
    return requests_;
  }

 private:
  void talk(LoopbackLine& line) {
    if (tls_ != nullptr && !line.encrypt(tls_)) return;
    std::string request = read(line);
    std::string answer;
    {
      const std::lock_guard lock(mutex_);
      requests_.push_back(request);
      answer = answers_.front();
      if (answers_.size() > 1) answers_.pop_front();
    }
    if (answer.empty()) {
      while (line.receive(request)) {
      }
    } else {
      line.send(answer);
    }
  }

  /// Header and body of the stated length.
  static std::string read(LoopbackLine& line) {
    std::string text;
    do {
      const std::size_t head = text.find("\r\n\r\n");
      if (head != std::string::npos) {
        const std::size_t at = text.find("Content-Length: ");
        const std::size_t body = at < head ? std::stoul(text.substr(at + 16)) : 0;
        if (text.size() >= head + 4 + body) break;
      }
    } while (line.receive(text));
    return text;
  }

  std::deque<std::string> answers_;
  ::SSL_CTX* tls_;
  std::mutex mutex_;
  std::vector<std::string> requests_;
  LoopbackServer server_{[this](LoopbackLine& line) { talk(line); }};
};

inline const std::string kTaken = "HTTP/1.1 204 No Content\r\nContent-Length: 0\r\n\r\n";
inline const std::string kBroken = "HTTP/1.1 503 Busy\r\nContent-Length: 0\r\n\r\n";
inline const std::string kRefused = "HTTP/1.1 404 None\r\nContent-Length: 0\r\n\r\n";

}  // namespace cellcal::daemon::testing
