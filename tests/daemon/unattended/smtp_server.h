#pragma once
// A scripted mail server with one thread on loopback.

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "tests/daemon/unattended/loopback_server.h"

namespace cellcal::daemon::testing {

class SmtpServer {
 public:
  struct Parts {
    ::SSL_CTX* tls = nullptr;
    bool from_the_first_byte = false;  ///< otherwise after STARTTLS
    /// Answers to lines with this beginning, instead of the default; "": no further answers.
    std::map<std::string, std::string> answers = {};
    /// Likewise, the first time only.
    std::map<std::string, std::string> first_answers = {};
  };

  explicit SmtpServer(Parts parts) : parts_(std::move(parts)) {}

  const std::string& port() const { return server_.port(); }
  /// All lines, without \r\n; those received over TLS begin with "tls ".
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
  static bool hear(LoopbackLine& line, std::string& buffer, std::string& text) {
    std::size_t end = 0;
    while ((end = buffer.find("\r\n")) == std::string::npos) {
      if (!line.receive(buffer)) return false;
    }
    text = buffer.substr(0, end);
    buffer.erase(0, end + 2);
    return true;
  }

  void talk(LoopbackLine& line) {
    if (parts_.from_the_first_byte && !line.encrypt(parts_.tls)) return;
    const auto say = [&](const std::string& text) { line.send(text + "\r\n"); };
    say("220 mail.example ESMTP");
    bool data = false;
    for (std::string buffer, text; hear(line, buffer, text);) {
      {
        const std::lock_guard lock(mutex_);
        lines_.push_back((line.encrypted() ? "tls " : "") + text);
      }
      if (data && text != ".") continue;
      data = false;
      const std::string* other = nullptr;
      for (const auto& [begin, answer] : parts_.answers) {
        if (text.starts_with(begin)) other = &answer;
      }
      std::string first;
      for (const auto& [begin, answer] : parts_.first_answers) {
        if (text.starts_with(begin)) first = begin;
      }
      if (!first.empty()) {
        say(parts_.first_answers[first]);
        parts_.first_answers.erase(first);
      } else if (other != nullptr) {
        if (other->empty()) {
          hear(line, buffer, text);  // until the client disconnects
          return;
        }
        say(*other);
      } else if (text.starts_with("EHLO")) {
        const bool offers = parts_.tls != nullptr && !line.encrypted();
        say(std::string("250-mail.example\r\n") + (offers ? "250-STARTTLS\r\n" : "") +
            "250 AUTH PLAIN");
      } else if (text == "STARTTLS") {
        say("220 go on");
        if (!line.encrypt(parts_.tls)) return;
      } else if (text.starts_with("AUTH PLAIN")) {
        say(text == "AUTH PLAIN" ? "334 " : "235 known");
      } else if (text == "DATA") {
        data = true;
        say("354 go on");
      } else if (text == "QUIT") {
        say("221 bye");
        return;
      } else {
        say(text.find(' ') == std::string::npos && text != "." ? "235 known" : "250 taken");
      }
    }
  }

  Parts parts_;
  std::mutex mutex_;
  std::vector<std::string> lines_;
  LoopbackServer server_{[this](LoopbackLine& line) { talk(line); }};
};

}  // namespace cellcal::daemon::testing
