// A backup of the journal during writes.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "daemon/journal/store/sqlite.h"
#include "images.h"
#include "temporary_directory.h"
#include "tests/daemon/journal/disks/losing_disk.h"

namespace cellcal::daemon::testing {
namespace {

std::string why_not(Journal& journal, const std::filesystem::path& file) {
  return error_of([&] { journal.backup(file); });
}

TEST(ABackup, IsAJournalOfItsOwnWithEveryRow) {
  const TemporaryDirectory dir;
  std::string original;
  {
    Journal journal(dir / "j.db");
    fill(journal, 20);
    EXPECT_TRUE(journal.backup(dir / "copy.db").empty());
    EXPECT_FALSE(std::filesystem::exists(dir / "copy.db.part"));
  }
  original = all_of(dir / "j.db");
  EXPECT_EQ(all_of(dir / "copy.db"), original);
}

TEST(ABackup, HoldsWhatTheScheduleHoldsAndAnAlteredRowOfItIsRefused) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    EXPECT_EQ(journal.schedule().state, "");
    EXPECT_FALSE(journal.schedule().newest) << "a journal was possibly moved aside";
    journal.store_schedule("before");
    journal.store_schedule("held");
    journal.backup(dir / "copy.db");
  }
  EXPECT_EQ(Journal(dir / "j.db").schedule().state, "held");
  EXPECT_TRUE(Journal(dir / "j.db").schedule().newest);
  for (int start = 0; start < 2; ++start) {
    EXPECT_EQ(Journal(dir / "copy.db").schedule().state, "held");
    EXPECT_FALSE(Journal(dir / "copy.db").schedule().newest) << "a later state may exist";
    std::filesystem::remove(dir / "copy.db.head");
  }
  {
    Journal copy(dir / "copy.db");
    copy.store_schedule("again");
    EXPECT_TRUE(copy.schedule().newest);
  }
  Database(dir / "j.db").execute("UPDATE schedule SET state = 'free'");
  Journal altered(dir / "j.db");
  EXPECT_THROW(altered.schedule(), DamagedError);
}

TEST(ABackup, MadeWhileASessionWritesIsWhatWasThereAtOneMoment) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  for (int i = 0; i < 20; ++i) fill(journal, 30);
  const std::int64_t id = journal.begin({}, "t0");
  std::atomic<std::size_t> written{0};
  std::atomic<bool> over{false};
  std::thread session([&] {
    while (!over) {
      journal.record(id, RecordTouch{written, touch_at(static_cast<double>(written))});
      ++written;
    }
  });
  while (written < 3) std::this_thread::yield();
  const std::size_t before = written;
  const std::string error = why_not(journal, dir / "copy.db");
  over = true;
  session.join();
  EXPECT_EQ(error, "");
  Journal copy(dir / "copy.db");
  const std::vector<calib::Touch> touches = copy.touches(id);
  EXPECT_GE(touches.size(), before);
  EXPECT_LE(touches.size(), written);
  for (std::size_t i = 0; i < touches.size(); ++i)
    EXPECT_EQ(touches[i], touch_at(static_cast<double>(i)));
  EXPECT_EQ(copy.sessions().size(), 21u);
}

TEST(ABackup, LetsCallsOfASessionThroughBetweenItsSteps) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  // Some thousands of pages, so that there are many steps.
  for (int i = 0; i < 4; ++i)
    journal.begin({"/c", std::string(2000000, 'c'), "/r", "r", "{}"}, "t0");
  const std::int64_t id = journal.begin({}, "t0");
  std::atomic<bool> copied{false};
  std::thread backup([&] {
    journal.backup(dir / "copy.db");
    copied = true;
  });
  std::size_t meanwhile = 0;
  while (!copied) journal.record(id, RecordTouch{meanwhile++, touch_at(0.0)});
  backup.join();
  EXPECT_GT(meanwhile, 5u) << "calls that wait until all of it is copied";
}

TEST(ABackup, ReplacesNoFile) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  fill(journal, 1);
  for (const char* name : {"there", "j.db"}) {
    if (std::string(name) == "there") std::ofstream(dir / name) << "mine";
    EXPECT_NE(why_not(journal, dir / name).find("there is a file of this name already"),
              std::string::npos);
  }
  std::filesystem::create_symlink(dir / "nowhere", dir / "link");
  EXPECT_NE(why_not(journal, dir / "link"), "");
  EXPECT_EQ(std::filesystem::file_size(dir / "there"), 4u);
  EXPECT_NE(why_not(journal, dir / "no" / "such").find("unable to open"), std::string::npos);
  EXPECT_EQ(journal.touches(1).size(), 1u);
}

TEST(ABackup, OfAJournalWithADamagedSessionSaysWhich) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    fill(journal, 1);
    fill(journal, 1);
  }
  Database(dir / "j.db").execute("UPDATE touch SET target='X' WHERE session=1");
  Journal journal(dir / "j.db");
  const auto remarks = journal.backup(dir / "copy.db");
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_EQ(remarks[0], "session 1 is damaged in the journal, and so it is in the copy");
}

TEST(ABackup, ThatIsCutOffAnywhereLeavesNoFileOfItsNameOrAWholeOne) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    fill(journal, 3);
  }
  const std::string original = all_of(dir / "j.db");
  int cuts = 0, whole = 0;
  for (long at = 0;; ++at) {
    const TemporaryDirectory here;
    copy_journal(dir / "j.db", here / "j.db");
    std::filesystem::create_directory(here / "b");
    if (!is_cut_in({here / "b", at, Cut::Unsynced::kLost}, [&] {
          Journal journal(here / "j.db");
          journal.backup(here / "b/copy.db");
        }))
      break;
    ++cuts;
    if (std::filesystem::exists(here / "b/copy.db")) {
      ++whole;
      ASSERT_EQ(all_of(here / "b/copy.db"), original) << "cut at " << at;
    }
    Journal journal(here / "j.db");
    EXPECT_EQ(why_not(journal, here / "b/later.db"), "");
  }
  std::printf("cut at each of %d writes; %d times the copy was there, and whole\n", cuts, whole);
  EXPECT_GT(cuts, 3);
}

}  // namespace
}  // namespace cellcal::daemon::testing
