// Power cut, or process killed, at each write of a session's journal.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "daemon/journal/journal.h"
#include "images.h"
#include "temporary_directory.h"
#include "tests/daemon/journal/disks/losing_disk.h"

namespace cellcal::daemon::testing {
namespace {

/// The child's progress in shared memory.
struct Progress {
  int touches = 0;    ///< whose calls have returned
  int attempted = 0;  ///< whose calls have begun
};

class Shared {
 public:
  Shared()
      : progress_(new (::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Progress) {}
  ~Shared() { ::munmap(progress_, sizeof(Progress)); }
  Progress* operator->() const { return progress_; }

 private:
  Progress* progress_;
};

constexpr int kTouches = 5;

void record_session(const std::filesystem::path& path, const Shared& progress) {
  Journal journal(path);
  const std::int64_t id = journal.begin({"/c", std::string(9000, 'c'), "/r", "robot", "{}"}, "t0");
  journal.record(id, RecordPlan{"hash", kTouches});
  for (int i = 0; i < kTouches; ++i) {
    RecordContact contact;
    contact.touch = static_cast<std::size_t>(i);
    journal.note(id, contact);
    journal.note(id, RecordChange{});
    journal.record(id, RecordReading{static_cast<std::size_t>(i), 0, {}});
    progress->attempted = i + 1;
    journal.record(id, RecordTouch{static_cast<std::size_t>(i), touch_at(0.1 + i)});
    progress->touches = i + 1;
  }
  journal.record(id, RecordEnd{Ending::kDone, ""}, "t1");
}

struct Count {
  int cuts = 0, behind = 0;
};

void expect_nothing_lost(const std::filesystem::path& path, const Shared& progress, Count& count,
                         const std::string& where) {
  ++count.cuts;
  ASSERT_EQ(refusal(path), "") << where;
  Journal journal(path);
  const auto sessions = journal.sessions();
  if (sessions.empty()) {
    ASSERT_EQ(progress->touches, 0) << where;
    return;
  }
  const std::int64_t id = sessions[0].id;
  const std::vector<calib::Touch> touches = journal.touches(id);
  ASSERT_GE(static_cast<int>(touches.size()), progress->touches) << where;
  ASSERT_LE(static_cast<int>(touches.size()), progress->attempted) << where;
  count.behind += static_cast<int>(touches.size()) > progress->touches;
  for (std::size_t i = 0; i < touches.size(); ++i)
    ASSERT_EQ(touches[i], touch_at(0.1 + static_cast<double>(i))) << where;
  if (sessions[0].state == RecordState::kDone) return;
  // And it can be resumed to its end.
  ASSERT_TRUE(journal.newest_resumable()) << where;
  journal.resume(id, "t2");
  for (std::size_t i = touches.size(); i < kTouches; ++i)
    journal.record(id, RecordTouch{i, touch_at(0.1 + static_cast<double>(i))});
  journal.record(id, RecordEnd{Ending::kDone, ""}, "t3");
  ASSERT_EQ(journal.touches(id).size(), std::size_t{kTouches}) << where;
}

struct ASessionWhosePowerIsCut : ::testing::TestWithParam<Cut::Unsynced> {};

TEST_P(ASessionWhosePowerIsCut, AtAnyWriteKeepsEveryTouchWhoseCallHadReturned) {
  Count count;
  for (long at = 0;; ++at) {
    const TemporaryDirectory dir;
    const Shared progress;
    if (!is_cut_in({dir.path(), at, GetParam(), static_cast<unsigned>(at) + 1},
                   [&] { record_session(dir / "j.db", progress); }))
      break;
    expect_nothing_lost(dir / "j.db", progress, count, "cut at write " + std::to_string(at));
    if (HasFatalFailure()) return;
  }
  std::printf(
      "cut at each of %d writes: no touch lost or doubled; %d times one was on disk before "
      "its call had returned\n",
      count.cuts, count.behind);
  EXPECT_GT(count.cuts, 60);
  EXPECT_GT(count.behind, 0) << "a cut between a commit and its answer was never met";
}

INSTANTIATE_TEST_SUITE_P(Journal, ASessionWhosePowerIsCut,
                         ::testing::Values(Cut::Unsynced::kStays, Cut::Unsynced::kLost,
                                           Cut::Unsynced::kTorn),
                         [](const auto& unsynced) {
                           return unsynced.param == Cut::Unsynced::kStays  ? "by_a_kill"
                                  : unsynced.param == Cut::Unsynced::kLost ? "and_loses_all"
                                                                           : "and_tears_sectors";
                         });

TEST(ADiskThatLoses, WhatWasNotSynchronizedDoesSo) {
  const TemporaryDirectory dir;
  const auto write_two = [&] {
    const int fd = ::open((dir / "f").c_str(), O_RDWR | O_CREAT, 0600);
    [[maybe_unused]] ssize_t put = ::pwrite(fd, "synced", 6, 0);
    ::fdatasync(fd);
    put = ::pwrite(fd, "lost!!", 6, 0);
    put = ::pwrite(fd, "lost", 4, 4096);
    put = ::pwrite(fd, "cut", 3, 0);
  };
  ASSERT_TRUE(is_cut_in({dir.path(), 3, Cut::Unsynced::kLost}, write_two));
  std::ifstream file(dir / "f");
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), "synced");
}

}  // namespace
}  // namespace cellcal::daemon::testing
