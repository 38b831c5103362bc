// Searches for spheres: the newest one is the retreat path of the next session.

#include <gtest/gtest.h>

#include <memory>

#include "daemon/journal/journal.h"
#include "daemon/journal/store/sqlite.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

RecordSearch search(double rad) {
  return {std::make_shared<const calib::SearchUnderWay>(calib::SearchUnderWay{
      "S1", {{rad, 1.0}, {rad + 0.1, 1.0}}, {rad + 0.2, 0.0}, {{rad + 0.05, 1.0}, {2.0, 2.0}}})};
}

RecordSearch way_home() {
  return {std::make_shared<const calib::SearchUnderWay>(
      calib::SearchUnderWay{"", {{0.0, 1.0}, {2.0, 2.0}}, {}, {}})};
}

TEST(ASearch, IsReadBackAsItWasRecordedAndTheNewestCounts) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    EXPECT_FALSE(journal.search_left());
    const std::int64_t id = fill(journal, 2);
    journal.record(id, search(0.3), "t1");
    journal.record(id, search(0.7), "t2");
  }
  Journal journal(dir / "j.db");
  EXPECT_TRUE(journal.remarks().empty());
  ASSERT_TRUE(journal.search_left());
  EXPECT_EQ(journal.search_left()->session, 1);
  EXPECT_EQ(journal.search_left()->search, *search(0.7).search);
  journal.record(1, way_home(), "t3");
  EXPECT_EQ(journal.search_left()->search, *way_home().search);
}

TEST(ASearch, IsOverOnceALaterSessionHasTouchedAndNotBefore) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  journal.record(fill(journal, 2), search(0.3), "t1");
  fill(journal, 0);
  EXPECT_TRUE(journal.search_left()) << "one that has made nothing";
  fill(journal, 1);
  EXPECT_FALSE(journal.search_left());
}

TEST(ASearch, ThatWasImportedHappenedElsewhere) {
  const TemporaryDirectory dir;
  std::string rows;
  {
    Journal elsewhere(dir / "e.db");
    elsewhere.record(fill(elsewhere, 2), search(0.3), "t1");
    rows = elsewhere.rows(1);
  }
  Journal journal(dir / "j.db");
  journal.record(fill(journal, 1), search(0.7), "t1");
  EXPECT_TRUE(journal.import(rows, "rows.jsonl").second);
  ASSERT_TRUE(journal.search_left());
  EXPECT_EQ(journal.search_left()->search, *search(0.7).search);
}

TEST(ASearch, ThatIsNotAsItWasWrittenIsRefused) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    journal.record(fill(journal, 2), search(0.3), "t1");
  }
  Database(dir / "j.db").execute("UPDATE search SET out_rad = way_rad");
  EXPECT_THROW(Journal(dir / "j.db").search_left(), DamagedError);
}

TEST(AHarmlessInterruption, IsCountedByItsCauseFromTheJournal) {
  const TemporaryDirectory dir;
  using drivers::Interruption;
  const InterruptionCounts expected{2, 0, 1};
  {
    Journal journal(dir / "j.db");
    const std::int64_t id = fill(journal, 1);
    for (const Interruption by :
         {Interruption::kLateBytes, Interruption::kPacketsStopped, Interruption::kLateBytes})
      journal.note(id, RecordCause{"t2", by});
    EXPECT_EQ(journal.interruptions(id), expected) << "before they are on disk";
    journal.record(id, RecordEnd{Ending::kDone, ""}, "t3");
    EXPECT_EQ(journal.interruptions(id), expected);
  }
  Journal journal(dir / "j.db");
  EXPECT_EQ(journal.interruptions(1), expected);
  EXPECT_EQ(journal.interruptions(1).total(), 3);
}

}  // namespace
}  // namespace cellcal::daemon::testing
