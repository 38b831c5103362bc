// Power cut, or process killed, at each write while facts are reported.

#include <gtest/gtest.h>

#include <cerrno>

#include "images.h"
#include "plain_reporter.h"
#include "temporary_directory.h"
#include "tests/daemon/journal/disks/losing_disk.h"

namespace cellcal::daemon::testing {
namespace {

struct OutboxWhosePowerIsCut : ::testing::TestWithParam<Cut::Unsynced> {};

TEST_P(OutboxWhosePowerIsCut, AtAnyWriteHasEachFactThatIsOnDiskAndNoOther) {
  const TemporaryDirectory made;
  { const Journal journal(made / "j.db"); }
  int cuts = 0;
  std::size_t most = 0;
  for (long at = 0;; ++at) {
    const TemporaryDirectory dir;
    copy_journal(made / "j.db", dir / "j.db");
    if (!is_cut_in({dir.path(), at, GetParam(), static_cast<unsigned>(at) + 1}, [&] {
          Journal journal(dir / "j.db");
          journal.report_to(std::make_shared<const PlainReporter>());
          const std::int64_t id = journal.begin({"c", "c", "r", "r", "{}"}, "t0");
          for (std::size_t i = 0; i < 3; ++i) journal.record(id, RecordTouch{i, touch_at(0.1)});
          journal.store_calibration(id, "{}");
          journal.record(id, RecordEnd{Ending::kDone, ""}, "t9",
                         {{"alarm", Worth::kResult, "withheld"}});
        }))
      break;
    ++cuts;
    ASSERT_EQ(refusal(dir / "j.db"), "") << "cut at write " << at;
    Journal journal(dir / "j.db");
    const auto rows = journal.waiting(0, 100);
    const auto sessions = journal.sessions();
    std::size_t facts = sessions.size();
    if (!sessions.empty()) {
      facts += journal.touches(1).size();
      facts += journal.session(1)->state == RecordState::kDone
                   ? 3
                   : 0;  // calibration, end and alarm, or none of them
    }
    ASSERT_EQ(rows.size(), facts) << at << "\n" << words_of(rows);
    for (std::size_t i = 0; i < rows.size(); ++i)
      ASSERT_EQ(rows[i].number, static_cast<std::int64_t>(i) + 1);
    most = std::max(most, facts);
  }
  EXPECT_GT(cuts, 10);
  EXPECT_GT(most, 3u);
}

INSTANTIATE_TEST_SUITE_P(Journal, OutboxWhosePowerIsCut,
                         ::testing::Values(Cut::Unsynced::kStays, Cut::Unsynced::kLost,
                                           Cut::Unsynced::kTorn));

TEST(AnOutbox, WhoseNextNameTheDiskDoesNotTakeTellsOnUnderTheOneBefore) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  journal.report_to(std::make_shared<const PlainReporter>(1 << 20, 1, "graz/weld-3"));
  const std::int64_t id = journal.begin({"c", "c", "r", "r", "{}"}, "t0");
  const auto next = std::make_shared<const PlainReporter>(1 << 20, 1, "graz/weld-4");
  {
    const FailingDisk disk(dir.path(), 0, EROFS);
    EXPECT_THROW(journal.report_to(next), JournalError);
  }
  journal.activate({id, "t", "anna", ""});
  EXPECT_EQ(words_of(journal.waiting(0, 9)), "1 session running\n2 activation anna\n");
  journal.report_to(next);
  EXPECT_EQ(journal.outbox().elsewhere, 2);
}

}  // namespace
}  // namespace cellcal::daemon::testing
