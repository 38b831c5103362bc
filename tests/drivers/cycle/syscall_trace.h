#pragma once
// Records every system call of one thread of this process, by a child process that traces it
// (ptrace). The traced code does not have to cooperate.

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cellcal::test {

struct Syscall {
  long number = 0;
  std::array<std::uint64_t, 6> arguments{};
};

class SyscallTrace {
 public:
  /// Starts here; the thread has to make calls from time to time, otherwise stop() waits.
  explicit SyscallTrace(pid_t thread);
  ~SyscallTrace();
  SyscallTrace(const SyscallTrace&) = delete;
  SyscallTrace& operator=(const SyscallTrace&) = delete;

  /// Empty, or the reason why this machine does not permit tracing.
  const std::string& why_not() const { return why_not_; }
  /// Ends the trace, and returns the calls in order.
  std::vector<Syscall> stop();

 private:
  struct Shared;
  Shared* shared_ = nullptr;  ///< between the two processes
  pid_t tracer_ = -1;
  std::string why_not_;
};

}  // namespace cellcal::test
