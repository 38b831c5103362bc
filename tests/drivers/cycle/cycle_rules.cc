#include "tests/drivers/cycle/cycle_rules.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <linux/futex.h>
#include <sys/epoll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <boost/asio/post.hpp>
#include <filesystem>
#include <fstream>
#include <future>
#include <map>
#include <set>
#include <sstream>
#include <string>

namespace cellcal::test {
namespace {

enum class Kind { kTerminal, kSocket, kEvent, kTimer, kPoll, kOther };

/// Kind of a descriptor of this process, and whether it can make a call wait.
struct Descriptor {
  Kind kind = Kind::kOther;
  bool waits = true;
  std::string name;
};

Descriptor descriptor(int fd) {
  std::error_code gone;
  Descriptor found;
  found.name = std::filesystem::read_symlink(fmt::format("/proc/self/fd/{}", fd), gone).string();
  const auto begins = [&](const char* with) { return found.name.rfind(with, 0) == 0; };
  if (begins("/dev/")) found.kind = Kind::kTerminal;
  if (begins("socket:")) found.kind = Kind::kSocket;
  if (begins("anon_inode:[eventfd]")) found.kind = Kind::kEvent;
  if (begins("anon_inode:[timerfd]")) found.kind = Kind::kTimer;
  if (begins("anon_inode:[eventpoll]")) found.kind = Kind::kPoll;
  const int flags = ::fcntl(fd, F_GETFL);
  found.waits = flags < 0 || (flags & O_NONBLOCK) == 0;
  return found;
}

/// The descriptors that an epoll descriptor watches.
std::vector<int> watched_by(int epoll) {
  std::ifstream file(fmt::format("/proc/self/fdinfo/{}", epoll));
  std::vector<int> found;
  for (std::string line; std::getline(file, line);) {
    int fd = -1;
    if (line.rfind("tfd:", 0) == 0 && std::istringstream(line.substr(4)) >> fd) found.push_back(fd);
  }
  return found;
}

/// Empty: it cannot sleep, except for the thread's main wait. Otherwise its name.
std::string objection(const Syscall& call) {
  const Descriptor on = descriptor(static_cast<int>(call.arguments[0]));
  const auto unless = [&](bool fine, const char* name) {
    return fine ? std::string() : fmt::format("{} on {}", name, on.name);
  };
  switch (call.number) {
    case SYS_epoll_wait:
    case SYS_epoll_pwait: return unless(on.kind == Kind::kPoll, "epoll_wait");
    case SYS_epoll_ctl: {
      const Descriptor target = descriptor(static_cast<int>(call.arguments[2]));
      // Adding and re-arming polls the file: a terminal's poll waits for a kernel worker.
      const bool fine = target.kind == Kind::kSocket || target.kind == Kind::kEvent ||
                        target.kind == Kind::kTimer;
      return fine ? std::string() : "epoll_ctl with " + target.name;
    }
    case SYS_timerfd_settime: return unless(on.kind == Kind::kTimer, "timerfd_settime");
    case SYS_read: return unless(on.kind == Kind::kEvent && !on.waits, "read");
    case SYS_write: return unless(on.kind == Kind::kEvent && !on.waits, "write");
    case SYS_recvfrom:
    case SYS_recvmsg: return unless(on.kind == Kind::kSocket && !on.waits, "receive");
    case SYS_sendto:
    case SYS_sendmsg: return unless(on.kind == Kind::kSocket && !on.waits, "send");
    case SYS_futex: {
      const auto what = static_cast<int>(call.arguments[1]) & FUTEX_CMD_MASK;
      return what == FUTEX_WAKE ? "" : fmt::format("futex operation {}", what);
    }
    case SYS_clock_gettime:  // if the machine's clock cannot be read without a call
    case SYS_restart_syscall:
    case SYS_rt_sigreturn: return {};
    default: return fmt::format("system call {}", call.number);
  }
}

}  // namespace

pid_t thread_of(boost::asio::io_context& context) {
  std::promise<pid_t> id;
  boost::asio::post(context, [&] { id.set_value(static_cast<pid_t>(::syscall(SYS_gettid))); });
  return id.get_future().get();
}

void expect_no_sleep(const std::vector<Syscall>& calls, int least_sent) {
  std::map<std::string, int> objections;
  std::map<long, int> kinds;
  std::set<int> polls;
  for (const Syscall& call : calls) {
    ++kinds[call.number];
    if (const std::string one = objection(call); !one.empty()) ++objections[one];
    if (call.number == SYS_epoll_wait || call.number == SYS_epoll_pwait) {
      polls.insert(static_cast<int>(call.arguments[0]));
    }
  }
  for (const auto& [what, count] : objections) ADD_FAILURE() << what << ", " << count << " times";
  // The trace covers an active cycle.
  EXPECT_GT(kinds[SYS_epoll_wait] + kinds[SYS_epoll_pwait], 100);
  EXPECT_GT(kinds[SYS_sendto] + kinds[SYS_sendmsg], least_sent);
  // An epoll wait polls all its descriptors.
  for (const int poll : polls) {
    for (const int fd : watched_by(poll)) {
      const Descriptor on = descriptor(fd);
      EXPECT_NE(on.kind, Kind::kTerminal) << "the thread's epoll wait watches " << on.name;
    }
  }
}

}  // namespace cellcal::test
