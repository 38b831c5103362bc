#pragma once
// Every system call that one thread of this process makes, seen by a child process that traces it
// (ptrace). Nothing of the traced code has to cooperate.

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
  /// From here on; the thread has to make a call now and then, or stop() waits for it.
  explicit SyscallTrace(pid_t thread);
  ~SyscallTrace();
  SyscallTrace(const SyscallTrace&) = delete;
  SyscallTrace& operator=(const SyscallTrace&) = delete;

  /// Empty, or why this machine does not let a thread be traced.
  const std::string& why_not() const { return why_not_; }
  /// Ends the trace, and gives all of it in the order of the calls.
  std::vector<Syscall> stop();

 private:
  struct Shared;
  Shared* shared_ = nullptr;  ///< between the two processes
  pid_t tracer_ = -1;
  std::string why_not_;
};

}  // namespace cellcal::test
