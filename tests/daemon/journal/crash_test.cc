// The process is killed at some instant; writes that had returned must be present.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/journal/journal.h"
#include "temporary_directory.h"

namespace cellcal::daemon {
namespace {

using testing::TemporaryDirectory;

calib::Touch numbered(int number) {
  calib::Touch touch;
  touch.joint_rad = {static_cast<double>(number)};
  touch.target = "S1";
  return touch;
}

/// Writes touches forever, and reports through the pipe, after each, how many are on disk.
[[noreturn]] void write_until_killed(const std::filesystem::path& path, int pipe) {
  Journal journal(path);
  const std::int64_t id = journal.begin({"c", "c", "r", "r", "{}"}, "t0");
  for (int i = 0;; ++i) {
    journal.record(id, RecordReading{});
    journal.record(id, RecordTouch{static_cast<std::size_t>(i), numbered(i)});
    const int count = i + 1;
    if (::write(pipe, &count, sizeof count) != sizeof count) ::_exit(1);
  }
}

TEST(AKilledDaemon, LeavesEveryCommittedTouchBehind) {
  for (int round = 0; round < 8; ++round) {
    const TemporaryDirectory dir;
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::close(ends[0]);
      write_until_killed(dir / "j.db", ends[1]);
    }
    ::close(ends[1]);
    int confirmed = 0, next = 0;
    while (confirmed < 3 + 2 * round && ::read(ends[0], &next, sizeof next) == sizeof next) {
      confirmed = next;
    }
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (::read(ends[0], &next, sizeof next) == sizeof next) confirmed = next;
    ::close(ends[0]);

    Journal journal(dir / "j.db");
    const auto record = journal.newest_resumable();
    ASSERT_TRUE(record);
    EXPECT_EQ(record->state, RecordState::kInterrupted);
    const auto touches = journal.touches(record->id);
    // The touch interrupted by the kill may be present or not, but never partially.
    ASSERT_GE(touches.size(), static_cast<std::size_t>(confirmed));
    EXPECT_LE(touches.size(), static_cast<std::size_t>(confirmed) + 1);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      EXPECT_EQ(touches[i], numbered(static_cast<int>(i)));
    }
  }
}

}  // namespace
}  // namespace cellcal::daemon
