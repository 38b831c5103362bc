#include "daemon/files/child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <thread>
#include <utility>

namespace cellcal::daemon {

namespace {

using Steady = std::chrono::steady_clock;
using Why = ChildEnd::Why;

constexpr std::chrono::milliseconds kPause{10};

/// Closes the descriptor unless closed before.
class Descriptor {
 public:
  Descriptor() = default;
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  void take(int fd) { fd_ = fd; }
  int get() const { return fd_; }

 private:
  int fd_ = -1;
};

/// One of the child's standard streams; ours does not block.
struct Stream {
  Descriptor ours, childs;

  int open(bool child_reads) {
    int ends[2] = {-1, -1};
    if (::pipe2(ends, O_CLOEXEC) != 0) return errno;
    ours.take(ends[child_reads ? 1 : 0]);
    childs.take(ends[child_reads ? 0 : 1]);
    ::fcntl(ours.get(), F_SETFL, O_NONBLOCK);
    return 0;
  }
  int open_nothing() {
    childs.take(::open("/dev/null", O_RDWR | O_CLOEXEC));
    return childs.get() < 0 ? errno : 0;
  }
};
using Streams = std::array<Stream, 3>;

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> all;
  for (std::string& word : words) all.push_back(word.data());
  all.push_back(nullptr);
  return all;
}

int spawn(const Child& child, const Streams& streams, pid_t& pid) {
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  for (int i = 0; i < 3; ++i)
    ::posix_spawn_file_actions_adddup2(&files, streams[static_cast<std::size_t>(i)].childs.get(),
                                       i);
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
  auto words = child.words, variables = child.environment;
  const int error =
      ::posix_spawnp(&pid, words[0].c_str(), &files, &attributes, pointers(words).data(),
                     variables.empty() ? environ : pointers(variables).data());
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  return error;
}

/// Closes the stream at its end.
void feed(Descriptor& to, const std::string& input, std::size_t& sent) {
  const ssize_t written = ::write(to.get(), input.data() + sent, input.size() - sent);
  if (written > 0) sent += static_cast<std::size_t>(written);
  const bool broken = written < 0 && errno != EAGAIN && errno != EINTR;
  if (broken || sent == input.size()) to.close();
}

void read_on(Descriptor& from, std::string& into) {
  std::array<char, 1 << 14> part;
  const ssize_t count = ::read(from.get(), part.data(), part.size());
  if (count > 0) into.append(part.data(), static_cast<std::size_t>(count));
  if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) from.close();
}

/// Until the child has closed its streams; else why it is to be terminated.
Why exchange(const Child& child, Streams& streams, Steady::time_point until, ChildEnd& end) {
  std::size_t sent = 0;
  while (std::ranges::any_of(streams, [](const Stream& one) { return one.ours.get() >= 0; })) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Steady::now());
    if (left.count() <= 0) return Why::kTooLong;
    std::array<pollfd, 3> ready;
    for (std::size_t i = 0; i < 3; ++i)
      ready[i] = {streams[i].ours.get(), static_cast<short>(i == 0 ? POLLOUT : POLLIN), 0};
    if (::poll(ready.data(), ready.size(), static_cast<int>(left.count())) <= 0) continue;
    if (ready[0].revents != 0) feed(streams[0].ours, child.input, sent);
    if (ready[1].revents != 0) read_on(streams[1].ours, end.out);
    if (ready[2].revents != 0) read_on(streams[2].ours, end.err);
    if (std::max(end.out.size(), end.err.size()) > child.most_output) return Why::kTooMuch;
  }
  return Why::kEnded;
}

}  // namespace

ChildEnd run_child(const Child& child) {
  const Steady::time_point until = Steady::now() + child.limit;
  ChildEnd end;
  Streams streams;
  for (std::size_t i = 0; i < 3 && end.error == 0; ++i) {
    const bool used = i == 0 ? !child.input.empty() : child.most_output > 0;
    end.error = used ? streams[i].open(i == 0) : streams[i].open_nothing();
  }
  pid_t pid = -1;
  if (end.error == 0) end.error = spawn(child, streams, pid);
  if (end.error != 0) {
    end.why = Why::kNotStarted;
    return end;
  }
  for (Stream& one : streams) one.childs.close();
  end.why = exchange(child, streams, until, end);
  int status = 0;
  pid_t ended = 0;
  while (end.why == Why::kEnded && (ended = ::waitpid(pid, &status, WNOHANG)) == 0) {
    if (Steady::now() >= until) end.why = Why::kTooLong;
    std::this_thread::sleep_for(kPause);
  }
  if (end.why != Why::kEnded && ended == 0) {
    ::kill(pid, SIGKILL);
    while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
  }
  if (ended > 0 && WIFEXITED(status)) end.status = WEXITSTATUS(status);
  return end;
}

}  // namespace cellcal::daemon
