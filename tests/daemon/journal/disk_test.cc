// A full disk, by the kernel's limit on this process's files.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include "daemon/journal/journal.h"
#include "temporary_directory.h"

namespace cellcal::daemon {
namespace {

/// No file of this process may grow beyond `bytes` during its lifetime.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limited = before_;
    limited.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limited);
  }
  ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

TEST(AFullDisk, IsANamedErrorAndLeavesTheEarlierTouchesWhole) {
  const testing::TemporaryDirectory dir;
  calib::Touch touch;
  touch.joint_rad = std::vector<double>(64, 0.5);
  touch.target = "S1";
  std::size_t written = 0;
  {
    Journal journal(dir / "j.db");
    const std::int64_t id = journal.begin({"c", "c", "r", "r", "{}"}, "t0");
    const FileSizeLimit limit(256 * 1024);
    try {
      while (written < 100000) {
        journal.record(id, RecordTouch{written, touch});
        ++written;
      }
      FAIL() << "the limit was never met";
    } catch (const JournalError& error) {
      EXPECT_NE(std::string(error.what()).find("j.db"), std::string::npos) << error.what();
    }
    EXPECT_THROW(journal.record(id, RecordTouch{written, touch}), JournalError);
    EXPECT_EQ(journal.touches(id).size(), written);
  }
  ASSERT_GT(written, 0u);
  Journal journal(dir / "j.db");
  EXPECT_EQ(journal.touches(journal.sessions()[0].id).size(), written);
  journal.record(journal.sessions()[0].id, RecordTouch{written, touch});
}

TEST(ASession, WhoseEndTheFullDiskDidNotTakeCanBeGoneOnWith) {
  const testing::TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin({"c", std::string(5000, 'c'), "r", "r", "{}"}, "t0");
  calib::Touch touch;
  touch.target = "S1";
  journal.record(id, RecordTouch{0, touch});
  {
    const FileSizeLimit limit(1024);
    EXPECT_THROW(journal.record(id, RecordTouch{1, touch}), JournalError);
    EXPECT_THROW(journal.record(id, RecordEnd{Ending::kFailed, "journal: full"}, "t1"),
                 JournalError);
  }
  const auto record = journal.newest_resumable();
  ASSERT_TRUE(record) << "what is there decides, not what was written last";
  EXPECT_EQ(record->id, id);
  EXPECT_EQ(record->state, RecordState::kInterrupted);
  EXPECT_EQ(record->touches, 1);
  journal.resume(id, "t2");
  EXPECT_EQ(journal.sessions()[0].state, RecordState::kRunning);
  journal.record(id, RecordTouch{1, touch});
  journal.record(id, RecordEnd{Ending::kDone, ""}, "t3");
  EXPECT_EQ(journal.sessions()[0].state, RecordState::kDone);
}

}  // namespace
}  // namespace cellcal::daemon
