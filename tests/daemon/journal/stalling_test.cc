// While a commit waits for the disk, notes of a session's thread and an abort do not wait.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "images.h"
#include "temporary_directory.h"
#include "tests/daemon/journal/disks/stalling_disk.h"

namespace cellcal::daemon::testing {
namespace {

TEST(ACommitThatWaitsForTheDisk, KeepsNoNoteWaiting) {
  const TemporaryDirectory dir;
  StallingDisk disk;
  Journal journal(dir / "j.db");
  const std::int64_t id = fill(journal, 1);
  disk.stall();
  std::atomic<bool> on_disk{false};
  std::thread writer([&] {
    journal.record(id, RecordTouch{1, touch_at(2.0)});
    on_disk = true;
  });
  disk.wait_until_stalled();
  journal.note(id, "t2", "slow search -> recording");  // would wait forever
  EXPECT_FALSE(on_disk);
  disk.release();
  writer.join();
  EXPECT_EQ(journal.touches(id).size(), 2u);
  EXPECT_EQ(journal.events(id).back(), "t2 slow search -> recording");
}

}  // namespace
}  // namespace cellcal::daemon::testing
