#include "daemon/notify/mail.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>
#include <vector>

namespace cellcal::daemon {

namespace {

using Steady = std::chrono::steady_clock;

/// RFC 2045: lines of at most 76 characters.
constexpr std::size_t kLongestLine = 72;
constexpr int kTryLater = 75;  // EX_TEMPFAIL
constexpr std::chrono::milliseconds kLook{10};

bool plain(unsigned char c) { return (' ' <= c && c <= '~') && c != '='; }

std::string quoted_printable(const std::string& text) {
  std::string out;
  std::size_t column = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == '\n') {
      out += '\n';
      column = 0;
      continue;
    }
    const bool ends_line = i + 1 == text.size() || text[i + 1] == '\n';
    // A line of a single full stop would end the mail for programs of old.
    const bool as_is = plain(c) && !(c == ' ' && ends_line) && !(c == '.' && column == 0);
    const std::string one =
        as_is ? std::string(1, static_cast<char>(c)) : fmt::format("={:02X}", c);
    if (column + one.size() > kLongestLine) {
      out += "=\n";
      column = 0;
    }
    out += one;
    column += one.size();
  }
  return out;
}

/// RFC 2047, word by word: "=?utf-8?Q?...?=". Words of whole characters.
std::string header_words(const std::string& text) {
  constexpr std::size_t kLongestWord = 60;
  std::string out, word;
  const auto put = [&] {
    if (word.empty()) return;
    out += (out.empty() ? "" : "\n ") + ("=?utf-8?Q?" + word + "?=");
    word.clear();
  };
  for (const char raw : text) {
    const auto c = static_cast<unsigned char>(raw);
    const bool begins_character = (c & 0xC0) != 0x80;
    if (begins_character && word.size() > kLongestWord) put();
    const bool letter = ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9');
    word += c == ' ' ? "_" : letter ? std::string(1, raw) : fmt::format("={:02X}", c);
  }
  put();
  return out;
}

/// Ends what is still open.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Its standard input is `input`, and there is nothing else.
pid_t spawn(const MailConfig& config, int input, int& error) {
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_adddup2(&files, input, STDIN_FILENO);
  ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t usual, none;
  ::sigemptyset(&usual);
  for (const int signal : {SIGPIPE, SIGXFSZ}) ::sigaddset(&usual, signal);
  ::sigemptyset(&none);
  ::posix_spawnattr_setsigdefault(&attributes, &usual);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  std::vector<std::string> words{config.program.string(), "-i", "-f", config.from, "--"};
  words.insert(words.end(), config.to.begin(), config.to.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::string path = "PATH=/usr/sbin:/usr/bin:/sbin:/bin";
  char* environment[] = {path.data(), nullptr};
  pid_t pid = -1;
  error = ::posix_spawn(&pid, config.program.c_str(), &files, &attributes, arguments.data(),
                        environment);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  return error == 0 ? pid : -1;
}

/// Until all of it is taken, nobody takes it any more, or time is up.
void feed(int fd, const std::string& mail, Steady::time_point end) {
  std::size_t sent = 0;
  while (sent < mail.size() && Steady::now() < end) {
    pollfd ready{fd, POLLOUT, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Steady::now());
    if (::poll(&ready, 1, static_cast<int>(left.count())) <= 0) continue;
    const ssize_t written = ::write(fd, mail.data() + sent, mail.size() - sent);
    if (written < 0 && errno != EAGAIN && errno != EINTR) return;
    if (written > 0) sent += static_cast<std::size_t>(written);
  }
}

Delivery wait_for(pid_t pid, const MailConfig& config, Steady::time_point end) {
  int status = 0;
  while (::waitpid(pid, &status, WNOHANG) == 0) {
    if (Steady::now() >= end) {
      ::kill(pid, SIGKILL);
      ::waitpid(pid, &status, 0);
      return {false, true, config.program.string() + " did not end in time"};
    }
    std::this_thread::sleep_for(kLook);
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {true, false, ""};
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return {false, code == kTryLater || code < 0,
          fmt::format("{} ended with status {}", config.program.string(), code)};
}

}  // namespace

std::string mail_text(const MailConfig& config, const Message& message, const std::string& date,
                      const std::string& id) {
  std::string to;
  for (const std::string& one : config.to) to += (to.empty() ? "" : ",\n ") + one;
  return fmt::format(
      "From: cellcal <{}>\nTo: {}\nSubject: {}\nDate: {}\nMessage-ID: <{}@{}>\nAuto-Submitted: auto-generated\n"
      "MIME-Version: 1.0\nContent-Type: text/plain; charset=utf-8\n"
      "Content-Transfer-Encoding: quoted-printable\n\n{}",
      config.from, to, header_words(message.subject), date, id,
      config.from.substr(config.from.find('@') + 1), quoted_printable(message.body));
}

Delivery send_mail(const MailConfig& config, const std::string& mail,
                   std::chrono::milliseconds longest) {
  const Steady::time_point end = Steady::now() + longest;
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC) != 0)
    return {false, true, std::string("no pipe: ") + std::strerror(errno)};
  Descriptor reader(ends[0]), writer(ends[1]);
  ::fcntl(writer.get(), F_SETFL, O_NONBLOCK);
  int error = 0;
  const pid_t pid = spawn(config, reader.get(), error);
  if (pid < 0) return {false, false, config.program.string() + ": " + std::strerror(error)};
  reader.close();
  feed(writer.get(), mail, end);
  writer.close();
  return wait_for(pid, config, end);
}

}  // namespace cellcal::daemon
