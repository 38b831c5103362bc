#include "tests/drivers/cycle/syscall_trace.h"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

namespace cellcal::test {

namespace {

constexpr std::size_t kMost = 1 << 18;
constexpr int kSyscallStop = SIGTRAP | 0x80;  // with PTRACE_O_TRACESYSGOOD

}  // namespace

struct SyscallTrace::Shared {
  std::atomic<int> begun{0};  ///< 1: the thread is traced; negative: -errno, not permitted
  std::atomic<bool> enough{false};
  std::atomic<std::size_t> count{0};
  std::array<Syscall, kMost> calls;
};

namespace {

/// The tracer's own process: calls nothing that could need a lock of its parent process.
template <typename Shared>
[[noreturn]] void trace(pid_t thread, Shared& shared) {
  int status = 0;
  const auto give_up = [&] {
    shared.begun = -errno;
    ::_exit(1);
  };
  if (::ptrace(PTRACE_SEIZE, thread, 0, PTRACE_O_TRACESYSGOOD) != 0) give_up();
  if (::ptrace(PTRACE_INTERRUPT, thread, 0, 0) != 0) give_up();
  if (::waitpid(thread, &status, __WALL) < 0) give_up();
  shared.begun = 1;
  long signal = 0;
  while (!shared.enough.load()) {
    if (::ptrace(PTRACE_SYSCALL, thread, 0, signal) != 0) break;
    if (::waitpid(thread, &status, __WALL) < 0 || !WIFSTOPPED(status)) break;
    signal = 0;
    if (WSTOPSIG(status) != kSyscallStop) {
      // A stop caused by the tracer has an event; any other signal belongs to the thread.
      if (status >> 16 == 0) signal = WSTOPSIG(status);
      continue;
    }
    struct __ptrace_syscall_info info {};
    if (::ptrace(PTRACE_GET_SYSCALL_INFO, thread, sizeof info, &info) < 0) break;
    if (info.op != PTRACE_SYSCALL_INFO_ENTRY) continue;
    const std::size_t at = shared.count.load();
    if (at >= kMost) continue;
    shared.calls[at].number = static_cast<long>(info.entry.nr);
    std::copy(std::begin(info.entry.args), std::end(info.entry.args),
              shared.calls[at].arguments.begin());
    shared.count = at + 1;
  }
  ::ptrace(PTRACE_DETACH, thread, 0, signal);
  ::_exit(0);
}

}  // namespace

SyscallTrace::SyscallTrace(pid_t thread) {
  void* memory =
      ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    why_not_ = std::string("mmap: ") + std::strerror(errno);
    return;
  }
  shared_ = new (memory) Shared;
  tracer_ = ::fork();
  if (tracer_ == 0) trace(thread, *shared_);
  if (tracer_ < 0) {
    why_not_ = std::string("fork: ") + std::strerror(errno);
    return;
  }
  ::prctl(PR_SET_PTRACER, tracer_, 0, 0, 0);  // fails if no permission is needed
  while (shared_->begun == 0) std::this_thread::sleep_for(std::chrono::milliseconds{1});
  if (shared_->begun < 0) {
    why_not_ = std::string("ptrace: ") + std::strerror(-shared_->begun);
  }
}

SyscallTrace::~SyscallTrace() {
  stop();
  if (shared_ != nullptr) ::munmap(shared_, sizeof(Shared));
}

std::vector<Syscall> SyscallTrace::stop() {
  if (shared_ == nullptr) return {};
  shared_->enough = true;
  if (tracer_ > 0) ::waitpid(tracer_, nullptr, 0);
  tracer_ = -1;
  const auto first = shared_->calls.begin();
  return {first, first + static_cast<std::ptrdiff_t>(shared_->count.load())};
}

}  // namespace cellcal::test
