// Work that crashes, in a process of the test: the supervisor waits for its children.

#include "daemon/files/supervisor.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <new>
#include <string>
#include <thread>

namespace cellcal::daemon::testing {
namespace {

using namespace std::chrono_literals;

/// Memory shared by parent and children.
struct Shared {
  std::atomic<int> begun{0};
  std::atomic<pid_t> work{0};
};

struct Supervisor : ::testing::Test {
  Supervisor()
      : shared(new (::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE,
                           MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared) {}
  ~Supervisor() override { ::munmap(shared, sizeof(Shared)); }

  /// Starts a supervisor process; end_of() returns its exit status.
  pid_t begin(const std::function<int(std::uint64_t)>& work, std::size_t most_bytes = 0) const {
    const pid_t process = ::fork();
    if (process != 0) return process;
    std::_Exit(supervise({.most_bytes = most_bytes, .first_wait = 1ms, .longest_wait = 4ms}, work));
  }
  static int end_of(pid_t process) {
    int status = 0;
    ::waitpid(process, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  void wait_for(int begun) const {
    for (int i = 0; i < 2000 && shared->begun < begun; ++i) std::this_thread::sleep_for(5ms);
    ASSERT_GE(shared->begun.load(), begun);
  }
  /// Waits until it has noticed the end of its work.
  static void wait_without_children(pid_t process) {
    const std::string task = std::to_string(process);
    for (int i = 0; i < 2000; ++i) {
      std::ifstream children("/proc/" + task + "/task/" + task + "/children");
      if (std::string one; !(children >> one)) return;
      std::this_thread::sleep_for(5ms);
    }
    FAIL() << "its work does not end";
  }

  Shared* shared;
};

TEST_F(Supervisor, BeginsWorkAgainThatASignalEndedAndSaysHowOften) {
  EXPECT_EQ(end_of(begin([](std::uint64_t restarts) {
              if (restarts < 3) std::abort();
              return static_cast<int>(restarts) + 40;
            })),
            43);
}

TEST_F(Supervisor, EndsAsWorkEndsThatEndsOfItself) {
  EXPECT_EQ(end_of(begin([this](std::uint64_t) {
              ++shared->begun;
              return 2;
            })),
            2);
  EXPECT_EQ(shared->begun, 1);
}

TEST_F(Supervisor, HandsASignalOnAndBeginsNothingMore) {
  const pid_t process = begin([this](std::uint64_t) {
    std::signal(SIGTERM, [](int) { std::_Exit(0); });
    ++shared->begun;
    for (;;) ::pause();
    return 1;
  });
  wait_for(1);
  ::kill(process, SIGTERM);
  EXPECT_EQ(end_of(process), 0);
  EXPECT_EQ(shared->begun, 1);
}

TEST_F(Supervisor, EndsWhileItWaitsToBeginAgain) {
  const pid_t process = ::fork();
  if (process == 0)
    std::_Exit(
        supervise({.most_bytes = 0, .first_wait = 1h, .longest_wait = 1h}, [this](std::uint64_t) {
          ++shared->begun;
          std::abort();
          return 1;
        }));
  wait_for(1);
  wait_without_children(process);
  ::kill(process, SIGTERM);
  EXPECT_EQ(end_of(process), 0);
}

TEST_F(Supervisor, TakesItsWorkWithItWhereItIsKilled) {
  const pid_t process = begin([this](std::uint64_t) {
    shared->work = ::getpid();
    ++shared->begun;
    for (;;) ::pause();
    return 1;
  });
  wait_for(1);
  ::kill(process, SIGKILL);
  end_of(process);
  const auto gone = [&] {  // its new parent may not have waited for it yet
    std::ifstream status("/proc/" + std::to_string(shared->work.load()) + "/stat");
    const std::string words{std::istreambuf_iterator<char>(status), {}};
    return words.empty() || words.find(") Z ") != std::string::npos;
  };
  for (int i = 0; i < 2000 && !gone(); ++i) std::this_thread::sleep_for(5ms);
  EXPECT_TRUE(gone());
}

TEST_F(Supervisor, LetsWorkLeaveNoCoreDump) {
  EXPECT_EQ(end_of(begin([](std::uint64_t) {
              rlimit core{};
              ::getrlimit(RLIMIT_CORE, &core);
              return core.rlim_cur == 0 && core.rlim_max == 0 ? 0 : 1;
            })),
            0);
}

TEST_F(Supervisor, GivesWorkNoMoreMemoryThanItMayHave) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer's own books are larger";
#endif
  EXPECT_EQ(end_of(begin(
                [](std::uint64_t) {
                  void* const large = std::malloc(std::size_t{256} << 20);
                  const bool refused = large == nullptr;
                  std::free(large);
                  return refused ? 0 : 1;
                },
                std::size_t{160} << 20)),
            0);
}

}  // namespace
}  // namespace cellcal::daemon::testing
