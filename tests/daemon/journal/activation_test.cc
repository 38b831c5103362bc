// Selection of the active calibration: rows are added, never changed.

#include <gtest/gtest.h>

#include "daemon/journal/store/sqlite.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

struct ActivationsOfAJournal : ::testing::Test {
  ActivationsOfAJournal() {
    Journal journal(dir / "j.db");
    one = fill(journal, 1);
    journal.record(one, RecordEnd{Ending::kDone, ""}, "t1");
    two = fill(journal, 1);
    journal.record(two, RecordEnd{Ending::kDone, ""}, "t2");
    journal.activate({one, "2026-01-02T00:00:00.000Z", "anna", "warm"});
    journal.activate({two, "2026-01-01T00:00:00.000Z", "ben", "cold \"again\"\n"});
  }
  TemporaryDirectory dir;
  std::int64_t one = 0, two = 0;
};

TEST_F(ActivationsOfAJournal, ComeBackInTheirOrderWhateverTheClocksSaid) {
  Journal journal(dir / "j.db");
  const auto all = journal.activations();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].session, one);
  EXPECT_EQ(all[1].session, two);
  EXPECT_EQ(all[1].reason, "cold \"again\"\n");
  EXPECT_GT(all[0].entry, journal.last_entry(two));
  EXPECT_GT(journal.last_entry(two), journal.last_entry(one));
  EXPECT_EQ(journal.last_entry(99), 0);
}

TEST_F(ActivationsOfAJournal, ThatWereChangedAreNotUsedAndTheirSessionIsRefused) {
  Database(dir / "j.db").execute("UPDATE activation SET reason='hot' WHERE who='anna'");
  Journal journal(dir / "j.db");
  ASSERT_EQ(journal.activations().size(), 1u);
  EXPECT_EQ(journal.activations()[0].session, two);
  EXPECT_THROW(journal.touches(one), JournalError);
}

TEST_F(ActivationsOfAJournal, ThatWerePutInOrTakenOutShow) {
  Database(dir / "j.db").execute("INSERT INTO activation VALUES (1, 't', 'nobody', 'x')");
  {
    Journal journal(dir / "j.db");
    EXPECT_EQ(journal.activations().size(), 2u);
    EXPECT_THROW(journal.touches(1), JournalError);
  }
  Database(dir / "j.db").execute("DELETE FROM activation WHERE session=2");
  Journal journal(dir / "j.db");
  EXPECT_THROW(journal.touches(2), JournalError);
}

TEST_F(ActivationsOfAJournal, GoWithTheirSessionIntoAnotherOne) {
  Journal journal(dir / "j.db"), other(dir / "other.db");
  const auto [session, is_new] = other.import(journal.rows(one), "rows");
  ASSERT_EQ(other.activations().size(), 1u);
  EXPECT_EQ(other.activations()[0].session, session);
  EXPECT_EQ(other.activations()[0].who, "anna");
}

}  // namespace
}  // namespace cellcal::daemon::testing
