#include "daemon/files/supervisor.h"

#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <system_error>

namespace cellcal::daemon {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kBySignal = 128;

timespec seconds_of(std::chrono::milliseconds time) {
  return {time.count() / 1000, (time.count() % 1000) * 1'000'000};
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryIsLimited = false;  // sanitizers need more
#else
constexpr bool kMemoryIsLimited = true;
#endif

/// Runs in the child process.
[[noreturn]] void live(const Supervision& limits, const sigset_t& before, pid_t supervisor,
                       const std::function<int(std::uint64_t)>& work, std::uint64_t restarts) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != supervisor) std::_Exit(1);  // the parent has already exited
  ::unsetenv("WATCHDOG_PID");                    // lets the child notify systemd's watchdog
  const rlimit none{0, 0};  // the end is expected, and core dumps would fill the disk
  ::setrlimit(RLIMIT_CORE, &none);
  if (kMemoryIsLimited && limits.most_bytes > 0) {
    const rlimit most{limits.most_bytes, limits.most_bytes};
    ::setrlimit(RLIMIT_DATA, &most);
  }
  ::sigprocmask(SIG_SETMASK, &before, nullptr);
  const int status = work(restarts);
  std::fflush(nullptr);
  std::_Exit(status);  // a thread blocked in a resolver is not joined
}

/// Waits for the end of the child, forwarding terminating signals. Returns the status of waitpid().
int end_of(pid_t child, const sigset_t& signals, bool& last) {
  for (;;) {
    int status = 0;
    if (::waitpid(child, &status, WNOHANG) == child) return status;
    siginfo_t info{};
    const int signal = ::sigwaitinfo(&signals, &info);
    if (signal != SIGTERM && signal != SIGINT) continue;
    last = true;
    ::kill(child, signal);
  }
}

}  // namespace

int supervise(const Supervision& limits, const std::function<int(std::uint64_t restarts)>& work) {
  sigset_t signals, before;
  ::sigemptyset(&signals);
  for (const int one : {SIGTERM, SIGINT, SIGCHLD}) ::sigaddset(&signals, one);
  ::sigprocmask(SIG_BLOCK, &signals, &before);
  const pid_t self = ::getpid();
  auto wait = std::chrono::milliseconds(0);
  for (std::uint64_t restarts = 0;; ++restarts) {
    const auto begun = Clock::now();
    const pid_t child = ::fork();
    if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (child == 0) live(limits, before, self, work, restarts);
    bool last = false;
    const int status = end_of(child, signals, last);
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    const int by = WTERMSIG(status);
    if (last) return by == SIGTERM || by == SIGINT ? 0 : kBySignal + by;
    if (Clock::now() - begun >= limits.lives) wait = {};
    wait = std::clamp(wait * 2, limits.first_wait, limits.longest_wait);
    spdlog::error(
        "the working process ended by signal {} ({}) and restarts in {:.1f} s. No data are lost. If it "
        "recurs, check what the broker sends",
        by, ::strsignal(by), std::chrono::duration<double>(wait).count());
    sigset_t ends = signals;
    ::sigdelset(&ends, SIGCHLD);
    const timespec pause = seconds_of(wait);
    if (::sigtimedwait(&ends, nullptr, &pause) > 0) return 0;
  }
}

}  // namespace cellcal::daemon
