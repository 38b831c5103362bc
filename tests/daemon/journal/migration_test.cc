// A journal of schema 1, as that version made it.

#include <gtest/gtest.h>

#include "daemon/journal/schema.h"
#include "daemon/journal/sqlite.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

/// Two sessions with touches, readings and events; the second was left running by a kill.
void make_version_1(const std::filesystem::path& path) {
  Database database(path);
  database.execute("PRAGMA journal_mode = WAL");
  database.execute(kSchema);
  database.execute(R"sql(
    PRAGMA application_id = 0x6363616c;
    PRAGMA user_version = 1;
    INSERT INTO session (started, ended, state, cell_name, cell_text, robot_name, robot_text,
                         options, plan_hash, planned)
      VALUES ('t0', 't1', 'done', '/c', 'cell', '/r', 'robot', '{}', 'h', 2),
             ('t2', '', 'running', '/c', 'cell', '/r', 'robot', '{}', 'h', 9);
    INSERT INTO touch VALUES
      (1, 0, x'000000000000f03f', 'S1', 0, 0, 0, x'', 't', x'', 2, 0.0, 0.002),
      (1, 1, x'000000000000f03f', 'S2', 1, 0, 0, x'', 't', x'', 2, 0.0, 0.002),
      (2, 0, x'000000000000f03f', 'S1', 0, 0, 0, x'', 't', x'', 2, 0.0, 0.002);
    INSERT INTO reading VALUES (2, 0, 0, 0, x'', x'', 0.0125, 0, 0, 0, 't'),
                               (2, 0, 1, 1, x'', x'', 0.0120, 0, 0, 0, 't');
    INSERT INTO event VALUES (2, 't', 'transit -> arming fast');
  )sql");
}

TEST(a_journal_of_version_1, is_taken_over_as_it_is_and_says_so) {
  const TemporaryDirectory dir;
  make_version_1(dir / "j.db");
  {
    Journal journal(dir / "j.db");
    ASSERT_EQ(journal.remarks().size(), 1u);
    EXPECT_NE(journal.remarks()[0].find("8 rows of an earlier version had no checksums"),
              std::string::npos)
        << journal.remarks()[0];
    ASSERT_EQ(journal.sessions().size(), 2u);
    EXPECT_EQ(journal.sessions()[1].state, "done");
    EXPECT_EQ(journal.touches(1).size(), 2u);
    EXPECT_EQ(journal.contacts(2).size(), 1u);
    EXPECT_EQ(journal.events(2).size(), 1u);
    const auto resumable = journal.newest_resumable();
    ASSERT_TRUE(resumable);
    EXPECT_EQ(resumable->state, "interrupted");
    journal.resume(2, "t3");
    journal.record(2, RecordTouch{1, touch_at(0.5)});
  }
  Journal again(dir / "j.db");
  EXPECT_TRUE(again.remarks().empty());
  EXPECT_EQ(again.touches(2).size(), 2u);
  EXPECT_EQ(again.touches(2)[0].joint_rad, std::vector<double>{1.0});
}

TEST(a_journal_of_version_1, has_its_rows_watched_from_then_on) {
  const TemporaryDirectory dir;
  make_version_1(dir / "j.db");
  { const Journal journal(dir / "j.db"); }
  Database(dir / "j.db").execute("UPDATE touch SET target='S3' WHERE session=1 AND number=0");
  Journal journal(dir / "j.db");
  EXPECT_THROW(journal.touches(1), JournalError);
  EXPECT_EQ(journal.touches(2).size(), 1u);
}

}  // namespace
}  // namespace cellcal::daemon::testing
