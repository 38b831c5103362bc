// The robot's thread sleeps only in its own epoll wait: checks every system call during searches
// over real interfaces (UDP, a pseudo-terminal).

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <future>
#include <thread>

#include "tests/bench/cell_session.h"
#include "tests/drivers/cycle/cycle_rules.h"
#include "tests/drivers/cycle/syscall_trace.h"

namespace cellcal::test {
namespace {

using namespace std::chrono_literals;

constexpr int kSearches = 3;
/// A loaded machine may fail some of them: late packets, late heartbeats.
constexpr int kTries = 30;

TEST(RobotThreadSyscalls, SleepsInNoSystemCallButItsOwnWaitDuringASearch) {
  bench::CellPeer peer({});
  bench::CellSession session(peer, {.patient = true});
  ASSERT_EQ(session.wait_until_ready(), "");
  const pid_t thread = thread_of(session.context());
  SyscallTrace trace(thread);
  if (!trace.why_not().empty()) {
    GTEST_SKIP() << "threads must not be traced here (" << trace.why_not() << ")";
  }
  int contacts = 0;
  for (int i = 0; i < kTries && contacts < kSearches; ++i) {
    if (session.search(std::nullopt)) ++contacts;
  }
  const std::vector<Syscall> calls = trace.stop();
  std::string spoilt;
  for (const auto& [why, count] : session.spoilt()) spoilt += fmt::format("\n{} ({})", why, count);
  ASSERT_EQ(contacts, kSearches) << spoilt;

  expect_no_sleep(calls, 100);
  peer.stop();
}

TEST(SyscallTraceSelfTest, SeesTheCallsOfAnotherThread) {
  std::atomic<bool> over{false};
  std::promise<pid_t> id;
  std::thread other([&] {
    id.set_value(static_cast<pid_t>(::syscall(SYS_gettid)));
    while (!over) ::usleep(1000);
  });
  SyscallTrace trace(id.get_future().get());
  const bool traced = trace.why_not().empty();
  std::this_thread::sleep_for(20ms);
  const std::vector<Syscall> calls = trace.stop();
  over = true;
  other.join();
  if (!traced) GTEST_SKIP() << "threads must not be traced here (" << trace.why_not() << ")";
  ASSERT_FALSE(calls.empty());
  EXPECT_TRUE(calls.back().number == SYS_clock_nanosleep || calls.back().number == SYS_nanosleep)
      << calls.back().number;
}

}  // namespace
}  // namespace cellcal::test
